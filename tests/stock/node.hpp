// A node on eProsima Fast DDS with the wire behavior of a ROS 2 node on rmw_fastrtps_cpp. Messages are raw bytes.
#pragma once
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

using namespace eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;
using Bytes = std::vector<uint8_t>;
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr uint32_t LARGEST = 1 << 16;

// A message as raw bytes: encapsulation header and CDR.
class RawType : public TopicDataType {
public:
    explicit RawType(const std::string& name) { setName(name.c_str()); m_typeSize = LARGEST; m_isGetKeyDefined = false; }
    bool serialize(void* data, SerializedPayload_t* payload) override {
        const auto& bytes = *static_cast<Bytes*>(data);
        std::memcpy(payload->data, bytes.data(), bytes.size());
        payload->length = static_cast<uint32_t>(bytes.size());
        payload->encapsulation = CDR_LE;
        return true;
    }
    bool deserialize(SerializedPayload_t* payload, void* data) override {
        static_cast<Bytes*>(data)->assign(payload->data, payload->data + payload->length);
        return true;
    }
    std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
        const auto size = static_cast<uint32_t>(static_cast<Bytes*>(data)->size());
        return [size] { return size; };
    }
    void* createData() override { return new Bytes; }
    void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
    bool getKey(void*, InstanceHandle_t*, bool) override { return false; }
};

// Writes CDR, little endian.
class Cdr {
public:
    Cdr() : bytes{0, 1, 0, 0} {}
    template <typename T> Cdr& put(T value) {
        while ((bytes.size() - 4) % sizeof(T) != 0) bytes.push_back(0);
        const auto* raw = reinterpret_cast<const uint8_t*>(&value);
        bytes.insert(bytes.end(), raw, raw + sizeof(T));
        return *this;
    }
    Cdr& put(const std::string& text) {
        put(static_cast<uint32_t>(text.size() + 1));
        bytes.insert(bytes.end(), text.begin(), text.end());
        bytes.push_back(0);
        return *this;
    }
    Bytes bytes;
};

inline void must(bool holds, const std::string& what) { if (!holds) throw std::runtime_error(what); }

template <typename Condition> void wait(const std::string& what, Condition condition, int seconds = 20) {
    const auto end = Clock::now() + std::chrono::seconds(seconds);
    while (!condition()) {
        must(Clock::now() < end, what + ": not within " + std::to_string(seconds) + " s");
        std::this_thread::sleep_for(milliseconds(1));
    }
}

// Applies the security settings of ROS 2's variables, like rmw_fastrtps. Does nothing if security is not requested.
inline void secure(DomainParticipantQos& qos) {
    const auto variable = [](const char* name) { const char* value = std::getenv(name); return std::string(value ? value : ""); };
    if (variable("ROS_SECURITY_ENABLE") != "true") return;
    const std::string enclave = "file://" + variable("ROS_SECURITY_KEYSTORE") + "/enclaves" + variable("ROS_SECURITY_ENCLAVE_OVERRIDE");
    const std::vector<std::pair<const char*, std::string>> properties = {
        {"auth.plugin", "builtin.PKI-DH"},
        {"auth.builtin.PKI-DH.identity_ca", enclave + "/identity_ca.cert.pem"},
        {"auth.builtin.PKI-DH.identity_certificate", enclave + "/cert.pem"},
        {"auth.builtin.PKI-DH.private_key", enclave + "/key.pem"},
        {"crypto.plugin", "builtin.AES-GCM-GMAC"},
        {"access.plugin", "builtin.Access-Permissions"},
        {"access.builtin.Access-Permissions.permissions_ca", enclave + "/permissions_ca.cert.pem"},
        {"access.builtin.Access-Permissions.governance", enclave + "/governance.p7s"},
        {"access.builtin.Access-Permissions.permissions", enclave + "/permissions.p7s"},
    };
    for (const auto& [name, value] : properties)
        qos.properties().properties().emplace_back(std::string("dds.sec.") + name, value);
}

// A node with one participant, as in rmw_fastrtps.
class Node {
public:
    Node() {
        DomainParticipantQos qos = PARTICIPANT_QOS_DEFAULT;
        const std::string enclave = "enclave=/;";
        qos.user_data().data_vec(std::vector<eprosima::fastrtps::rtps::octet>(enclave.begin(), enclave.end()));
        secure(qos);
        participant = DomainParticipantFactory::get_instance()->create_participant(std::atoi(std::getenv("ROS_DOMAIN_ID")), qos);
        must(participant, "no participant");
        publisher = participant->create_publisher(PUBLISHER_QOS_DEFAULT);
        subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
    }
    ~Node() {
        participant->delete_contained_entities();
        DomainParticipantFactory::get_instance()->delete_participant(participant);
    }
    Topic* topic(const std::string& name, const std::string& type) {
        TypeSupport support(new RawType(type));
        support.register_type(participant);
        auto* known = participant->lookup_topicdescription(name);
        return known ? static_cast<Topic*>(known) : participant->create_topic(name, type, TOPIC_QOS_DEFAULT);
    }
    DataWriter* writer(const std::string& name, const std::string& type, int depth = 10, bool reliable = true, bool latched = false) {
        DataWriterQos qos = DATAWRITER_QOS_DEFAULT;
        qos.publish_mode().kind = SYNCHRONOUS_PUBLISH_MODE;
        qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
        qos.data_sharing().off();
        qos.reliability().kind = reliable ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
        qos.durability().kind = latched ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
        qos.history().kind = KEEP_LAST_HISTORY_QOS;
        qos.history().depth = depth;
        auto* writer = publisher->create_datawriter(topic(name, type), qos);
        must(writer, "no writer on " + name);
        return writer;
    }
    DataReader* reader(const std::string& name, const std::string& type) {
        DataReaderQos qos = DATAREADER_QOS_DEFAULT;
        qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
        qos.data_sharing().off();
        qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
        qos.history().kind = KEEP_LAST_HISTORY_QOS;
        qos.history().depth = 1000;
        auto* reader = subscriber->create_datareader(topic(name, type), qos);
        must(reader, "no reader on " + name);
        return reader;
    }
    DomainParticipant* participant;
    Publisher* publisher;
    Subscriber* subscriber;
};

inline int readers(DataWriter* writer) {
    PublicationMatchedStatus status;
    writer->get_publication_matched_status(status);
    return status.current_count;
}

inline const std::string RCL = "rcl_interfaces::srv::dds_::";

// A client of a service. Its requests name the reader of the replies.
class Client {
public:
    Client(Node& node, const std::string& service, const std::string& type)
        : service(service),
          requests(node.writer("rq" + service + "Request", type + "_Request_")),
          replies(node.reader("rr" + service + "Reply", type + "_Response_")) {
        wait("the service " + service, [&] {
            SubscriptionMatchedStatus servers;
            replies->get_subscription_matched_status(servers);
            return readers(requests) > 0 && servers.current_count > 0;
        });
    }
    // Returns the reply as text that can be searched for strings.
    std::string call(Bytes request) {
        eprosima::fastrtps::rtps::WriteParams identity;
        identity.related_sample_identity().writer_guid() = replies->guid();
        must(requests->write(&request, identity), "a request to " + service + " could not be written");
        const auto number = identity.sample_identity().sequence_number().to64long();
        wait("a reply of " + service + " to " + std::to_string(request.size()) + " bytes", [&] {
            take();
            return answers.count(number) > 0;
        }, 5);
        return answers[number].front();
    }
    // Returns the number of replies to requests of this client.
    size_t answered() {
        take();
        size_t all = 0;
        for (const auto& [number, replies] : answers) all += replies.size();
        return all;
    }
private:
    void take() {
        Bytes reply;
        SampleInfo info;
        while (replies->take_next_sample(&reply, &info) == ReturnCode_t::RETCODE_OK)
            if (info.valid_data && info.related_sample_identity.writer_guid() == replies->guid())
                answers[info.related_sample_identity.sequence_number().to64long()].emplace_back(reply.begin(), reply.end());
    }
    std::map<uint64_t, std::vector<std::string>> answers;
    std::string service;
    DataWriter* requests;
    DataReader* replies;
};

inline const std::string POSE = "geometry_msgs::msg::dds_::PoseStamped_";
inline const std::string JOINTS = "sensor_msgs::msg::dds_::JointState_";
inline const std::string LOG = "rcl_interfaces::msg::dds_::Log_";

// Returns a goal that is easy to reach; the number distinguishes it from others.
inline Bytes goal(int number) {
    Cdr cdr;
    cdr.put<int32_t>(number).put<uint32_t>(0).put(std::string("base_link"));
    for (double value : {-0.125, 0.2, 0.2 + 1e-5 * number, 0.0, 0.0, 0.0, 1.0}) cdr.put(value);
    return cdr.bytes;
}
