// Nodes on eProsima Fast DDS with the keys of ROS_SECURITY_ENCLAVE_OVERRIDE, like those of rmw_fastrtps_cpp. Usage: peer CASE.
// Fails with a line on stderr and exit code 1.
#include "../stock/node.hpp"

#include <functional>
#include <iostream>
#include <map>

const std::string STD = "std_srvs::srv::dds_::";

std::string letters(int count) { return std::string(count, 'x'); }

// Parameter `name`, a list of one string: rcl_interfaces/Parameter, whose last field is that list.
Bytes string_list(const std::string& name, const std::string& text) {
    Cdr cdr;
    cdr.put<uint32_t>(1).put(name).put<uint8_t>(9).put<uint8_t>(0).put<int64_t>(0).put(0.0).put(std::string());
    for (int empty = 0; empty < 4; ++empty) cdr.put<uint32_t>(0);
    return cdr.put<uint32_t>(1).put(text).bytes;
}

// parameters: calls each parameter service, with requests and replies whose lengths have every remainder.
void parameters() {
    Node node;
    const std::map<std::string, std::string> types = {
        {"get_parameters", "GetParameters"}, {"get_parameter_types", "GetParameterTypes"},
        {"describe_parameters", "DescribeParameters"}, {"list_parameters", "ListParameters"},
        {"set_parameters", "SetParameters"}, {"set_parameters_atomically", "SetParametersAtomically"},
    };
    for (const auto& [name, type] : types) {
        Client client(node, "/dq_servo/" + name, RCL + type);
        if (name == "list_parameters") {
            const std::string all = client.call(Cdr().put<uint32_t>(0).put<uint64_t>(0).bytes);
            must(all.find("gains.predefined_time") != std::string::npos, "the list of all parameters is not whole");
        }
        for (int length = 1; length <= 8; ++length) {
            // A list of names of parameters, or of prefixes, which a depth follows.
            Bytes request = Cdr().put<uint32_t>(1).put(letters(length)).bytes;
            if (name == "list_parameters") request = Cdr().put<uint32_t>(1).put(letters(length)).put<uint64_t>(0).bytes;
            const bool sets = name.rfind("set_", 0) == 0;
            if (sets) request = string_list(letters(9 - length), letters(length));
            const std::string reply = client.call(request);
            must(!sets || reply.find("unknown parameter") != std::string::npos, name + " gave no reason: " + reply);
        }
    }
}

// calls: calls services with one byte, a boolean or nothing, many times.
void calls() {
    Node node;
    Client stop(node, "/dq_servo/stop", STD + "Trigger"), pause(node, "/dq_servo/pause", STD + "SetBool");
    for (int round = 0; round < 5; ++round) {
        must(stop.call(Cdr().put<uint8_t>(0).bytes)[4] == 1, "~/stop failed");
        for (uint8_t data : {1, 0}) must(pause.call(Cdr().put(data).bytes)[4] == 1, "~/pause failed");
    }
}

// stop: calls one service.
void stop() {
    Node node;
    Client(node, "/dq_servo/stop", STD + "Trigger").call(Cdr().put<uint8_t>(0).bytes);
}

// strings: publishes texts of 0 to 20 letters.
void strings() {
    Node node;
    auto* writer = node.writer("rt/robot_description", "std_msgs::msg::dds_::String_", 100, true, true);
    wait("a subscriber", [&] { return readers(writer) > 0; });
    for (int length = 0; length <= 20; ++length) {
        Bytes message = Cdr().put(letters(length)).bytes;
        must(writer->write(&message), "a text could not be written");
    }
    wait("the acknowledgment of all texts", [&] { return writer->wait_for_acknowledgments({1, 0}); });
}

// goal: sends the arm somewhere once a second, and waits until the servo reports the arrival. On a busy machine the first goal arrives
// seconds late, because the servo gets its key only then, and is rejected: "send it again".
void send_goal() {
    Node node;
    auto* writer = node.writer("rt/goal_pose", POSE);
    auto* status = node.reader("rt/dq_servo/status", "diagnostic_msgs::msg::dds_::DiagnosticStatus_");
    wait("the servo", [&] { return readers(writer) > 0; });
    Bytes sent = goal(1), heard;
    auto next = Clock::now();
    wait("the state settled", [&] {
        if (Clock::now() >= next) {
            must(writer->write(&sent), "a goal could not be written");
            next += std::chrono::seconds(1);
        }
        SampleInfo info;
        while (status->take_next_sample(&heard, &info) == ReturnCode_t::RETCODE_OK)
            if (info.valid_data && std::string(heard.begin(), heard.end()).find("settled") != std::string::npos) return true;
        return false;
    });
}

// rclpy: the endpoints that rclpy creates for a command-line node are permitted, and serving another node's parameters is not.
void rclpy() {
    Node node;
    const auto served = [&](const std::string& name, const std::string& type) {
        node.reader("rq" + name + "Request", type + "_Request_");
        node.writer("rr" + name + "Reply", type + "_Response_");
    };
    node.writer("rt/rosout", LOG);
    node.writer("rt/parameter_events", "rcl_interfaces::msg::dds_::ParameterEvent_");
    node.reader("rt/parameter_events", "rcl_interfaces::msg::dds_::ParameterEvent_");
    served("/_ros2cli_4711/get_type_description", "type_description_interfaces::srv::dds_::GetTypeDescription");
    for (const char* type : {"GetParameters", "SetParameters"})
        served(std::string("/_ros2cli_4711/") + (type[0] == 'G' ? "get" : "set") + "_parameters", RCL + type);
    try {
        served("/puma560/set_parameters", RCL + "SetParameters");
    } catch (const std::exception&) {
        return;
    }
    must(false, "the enclave may serve another node's parameters");
}

int main(int count, char** arguments) {
    const std::map<std::string, std::function<void()>> cases = {
        {"parameters", parameters}, {"calls", calls}, {"stop", stop}, {"strings", strings}, {"goal", send_goal}, {"rclpy", rclpy},
    };
    try {
        must(count == 2 && cases.count(arguments[1]), "usage: peer parameters | calls | stop | strings | goal | rclpy");
        cases.at(arguments[1])();
    } catch (const std::exception& why) {
        std::cerr << "peer: " << why.what() << std::endl;
        return 1;
    }
    return 0;
}
