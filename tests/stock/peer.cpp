// A peer on eProsima Fast DDS with the wire behavior of a ROS 2 node on rmw_fastrtps_cpp. Usage: peer CASE [ARGUMENT ...].
// Fails with a line on stderr and exit code 1.
#include <algorithm>
#include "node.hpp"

#include <atomic>
#include <iostream>

// Does what `ros2 topic pub --once` does: waits for a subscriber, publishes, and leaves 0.1 s later.
void publish_once(Node& node, int number) {
    auto* writer = node.writer("rt/goal_pose", POSE);
    wait("a subscriber of goal_pose", [&] { return readers(writer) > 0; });
    Bytes message = goal(number);
    must(writer->write(&message), "a goal could not be written");
    std::this_thread::sleep_for(milliseconds(100));
    node.publisher->delete_datawriter(writer);
}

// Keeps every core busy while it lives.
class Load {
public:
    Load() {
        for (unsigned i = 0; i < std::thread::hardware_concurrency(); ++i)
            threads.emplace_back([this] { while (!done) {} });
    }
    ~Load() { done = true; for (auto& thread : threads) thread.join(); }
private:
    std::atomic<bool> done{false};
    std::vector<std::thread> threads;
};

// Waits until the servo's participant and this one know each other, as for `ros2 topic pub` when it publishes.
void meet(Node& node) {
    auto* poses = node.reader("rt/dq_servo/current_pose", POSE);
    wait("a pose", [&] {
        Bytes message;
        SampleInfo info;
        return poses->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK && info.valid_data;
    });
    node.subscriber->delete_datareader(poses);
}

// goals COUNT: runs this many short-lived publishers, four at a time, on a busy machine.
void goals(int count) {
    Load load;
    std::atomic<int> next{0};
    std::atomic<bool> failed{false};
    std::vector<std::thread> users;
    for (int user = 0; user < 4; ++user)
        users.emplace_back([&] {
            try {
                Node node;
                meet(node);
                for (int number = next++; number < count; number = next++) publish_once(node, number);
            } catch (const std::exception& why) {
                std::cerr << why.what() << std::endl;
                failed = true;
            }
        });
    for (auto& user : users) user.join();
    must(!failed, "a publisher failed");
}

// Returns the value of a key in a diagnostic status.
std::string value_of(const Bytes& message, const std::string& key) {
    auto at = std::search(message.begin(), message.end(), key.c_str(), key.c_str() + key.size() + 1);
    if (at == message.end()) return "";
    const size_t place = (at - message.begin() + key.size() + 1 + 3) / 4 * 4;
    if (place + 4 > message.size()) return "";
    const size_t end = place + 4 + message[place] - 1;
    return end > message.size() ? "" : std::string(message.begin() + place + 4, message.begin() + end);
}

// taken COUNT: checks that the servo's status reports this many goals that began a motion.
void taken(int count) {
    Node node;
    auto* statuses = node.reader("rt/dq_servo/status", "diagnostic_msgs::msg::dds_::DiagnosticStatus_");
    std::string taken;
    try {
        wait("the goals", [&] {
            Bytes message;
            SampleInfo info;
            while (statuses->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK)
                if (info.valid_data) taken = value_of(message, "goal_count");
            return taken == std::to_string(count);
        }, 5);
    } catch (const std::exception& why) {
        must(false, std::string(why.what()) + ", goal_count is " + taken);
    }
}

// stream SECONDS: publishes numbered goals at 200 Hz.
void stream(double seconds) {
    Node node;
    auto* writer = node.writer("rt/goal_pose", POSE, 1000);
    const auto start = Clock::now();
    for (int number = 0; Clock::now() - start < std::chrono::duration<double>(seconds); ++number) {
        Bytes message = goal(number);
        must(writer->write(&message), "a goal could not be written");
        std::this_thread::sleep_until(start + milliseconds(5) * (number + 1));
    }
    wait("the acknowledgment of all goals", [&] { return writer->wait_for_acknowledgments({1, 0}); });
}

// warned -: checks that the servo warns on /rosout of joint states that it cannot receive.
void warned() {
    Node node;
    auto* log = node.reader("rt/rosout", LOG);
    std::this_thread::sleep_for(milliseconds(500));
    node.writer("rt/joint_states", JOINTS, 10, false);
    wait("a warning", [&] {
        Bytes message;
        SampleInfo info;
        while (log->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK) {
            const std::string text(message.begin(), message.end());
            if (text.find("/joint_states is not heard from") != std::string::npos && text.find("(01.0f.") != std::string::npos
                && text.find("it offers BEST_EFFORT, this node asks for RELIABLE") != std::string::npos) return true;
        }
        return false;
    });
}

// Returns the number in four bytes of CDR at this position.
uint32_t number(const std::string& cdr, size_t at) {
    uint32_t number = 0;
    must(cdr.size() >= at + sizeof number, "a reply of " + std::to_string(cdr.size()) + " bytes");
    std::memcpy(&number, cdr.data() + at, sizeof number);
    return number;
}

Bytes of_names(const std::vector<std::string>& names) {
    Cdr cdr;
    cdr.put(static_cast<uint32_t>(names.size()));
    for (const auto& name : names) cdr.put(name);
    return cdr.bytes;
}

// Returns the names in a reply of list_parameters.
std::vector<std::string> listed(const std::string& reply) {
    std::vector<std::string> names;
    size_t at = 8;
    for (uint32_t left = number(reply, 4); left > 0; --left) {
        const auto length = number(reply, at);
        must(reply.size() >= at + 4 + length, "a name is cut");
        names.push_back(reply.substr(at + 4, length - 1));
        at += 4 + (length + 3) / 4 * 4;
    }
    return names;
}

// replies ROUNDS: checks that the servo's replies of all lengths arrive complete and once, each at one of two clients.
void replies(int rounds) {
    Node node, other;
    const std::string get = "/dq_servo/get_parameters";
    Client list(node, "/dq_servo/list_parameters", RCL + "ListParameters");
    Client values(node, get, RCL + "GetParameters"), others(other, get, RCL + "GetParameters");
    for (int round = 0; round < rounds; ++round) {
        const auto names = listed(list.call(Cdr().put<uint32_t>(0).put<uint64_t>(0).bytes));
        must(names.size() > 30, "only " + std::to_string(names.size()) + " names");
        const auto dump = values.call(of_names(names));
        must(number(dump, 4) == names.size() && dump.size() > 2000, "values of " + std::to_string(dump.size()) + " bytes");
        const auto one = values.call(of_names({"joints"})).size() - 8;
        const std::vector<std::string> many(60000 / one, "joints");
        const auto long_reply = values.call(of_names(many));
        must(number(long_reply, 4) == many.size() && long_reply.size() > 55000, "a long reply of " + std::to_string(long_reply.size()) + " bytes");
        must(others.call(of_names({"joints"})).size() > 40, "the other client has a short answer");
    }
    std::this_thread::sleep_for(milliseconds(500));
    const auto expected = static_cast<size_t>(rounds);
    must(list.answered() == expected && values.answered() == 3 * expected && others.answered() == expected,
         "replies: " + std::to_string(list.answered()) + ", " + std::to_string(values.answered()) + ", " + std::to_string(others.answered()));
}

int main(int count, char** arguments) {
    const std::vector<std::string> words(arguments + 1, arguments + count);
    try {
        must(words.size() == 2, "usage: peer goals COUNT | taken COUNT | stream SECONDS | replies ROUNDS | warned -");
        if (words[0] == "warned") warned();
        else if (words[0] == "replies") replies(std::stoi(words[1]));
        else if (words[0] == "goals") goals(std::stoi(words[1]));
        else if (words[0] == "taken") taken(std::stoi(words[1]));
        else if (words[0] == "stream") stream(std::stod(words[1]));
        else must(false, "no case " + words[0]);
    } catch (const std::exception& why) {
        std::cerr << "peer: " << why.what() << std::endl;
        return 1;
    }
    return 0;
}
