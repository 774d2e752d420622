// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/serve/igtl_server.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <palpate/drivers/igtl_reader.h>

namespace palpate {
namespace {

namespace asio = boost::asio;
using testing::HasSubstr;
using testing::ThrowsMessage;

IgtlBytes message(const std::string& type, IgtlVersion version, const IgtlBytes& content = {},
                  const std::string& device = "") {
    IgtlMessage sent;
    sent.version = version;
    sent.type = type;
    sent.device = device;
    sent.content = content;
    return igtl_bytes(sent);
}

/// A client that takes what it is told to.
class Client {
public:
    explicit Client(const IgtlServer& server) {
        socket_.open(asio::ip::tcp::v4());
        // Small, so that what is not read soon stops the server's writing.
        socket_.set_option(asio::socket_base::receive_buffer_size(16 * 1024));
        socket_.connect({asio::ip::make_address("127.0.0.1"), server.port()});
    }

    void send(const IgtlBytes& bytes) { asio::write(socket_, asio::buffer(bytes)); }
    /// The next message, of any size; nothing once the server has closed.
    std::optional<IgtlMessage> next() {
        IgtlBytes head(kIgtlHeader);
        boost::system::error_code error;
        asio::read(socket_, asio::buffer(head), error);
        if (error) return std::nullopt;
        const auto header = read_igtl_header(std::span<const std::uint8_t, kIgtlHeader>(head));
        if (!header) return std::nullopt;
        IgtlBytes body(header->body_bytes);
        asio::read(socket_, asio::buffer(body), error);
        return error ? std::nullopt : read_igtl_body(*header, body);
    }
    /// The next one of that type.
    std::optional<IgtlMessage> next(const std::string& type) {
        for (;;) {
            std::optional<IgtlMessage> found = next();
            if (!found || found->type == type) return found;
        }
    }

private:
    asio::io_context io_;
    asio::ip::tcp::socket socket_{io_};
};

/// A mesh of so many triangles, all alike.
std::shared_ptr<const TriangleMesh> mesh_of(std::size_t triangles) {
    auto mesh = std::make_shared<TriangleMesh>();
    mesh->vertices = {{0.0, 0.0, 0.0}, {0.01, 0.0, 0.0}, {0.0, 0.01, 0.0}};
    mesh->triangles.assign(triangles, {0, 1, 2});
    return mesh;
}

IgtlServerSettings any_port() {
    IgtlServerSettings settings;
    settings.port = 0;
    settings.words = "a test";
    return settings;
}

RunFrame frame(std::uint64_t number) {
    RunFrame run;
    run.frame.frame = number;
    run.frame.time_s = 1e-3 * static_cast<double>(number);
    run.frame.probe = {1e-6 * static_cast<double>(number), 0.0, 0.0};
    return run;
}

/// Waits as long as a slow machine may take.
template <class Condition>
bool comes_true(const Condition& condition) {
    for (int i = 0; i < 6000; ++i) {
        if (condition()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
}

/// The first letters of the types of so many messages, in the order of the alphabet: surfaces and
/// transforms take turns as it comes. Of one frame, which is the third.
std::string types_of_next(Client& client, int count, IgtlVersion version) {
    std::string types;
    for (int i = 0; i < count; ++i) {
        const auto found = client.next();
        if (!found) return types + "!";
        EXPECT_EQ(found->version, version);
        if (found->type == "TRANSFORM" && version == IgtlVersion::two) {
            EXPECT_EQ(found->id, 3u);
        }
        types += found->type[0];
    }
    std::sort(types.begin(), types.end());
    return types;
}

TEST(IgtlServer, SpeaksTheVersionOfTheClient) {
    IgtlServer server(any_port(), {{"s", {1, 0, 0, 1}, mesh_of(2)}}, {});
    server.show(frame(3));
    Client two(server);
    two.send(message("STATUS", IgtlVersion::two, igtl_status_content({})));
    const auto status = two.next();
    ASSERT_TRUE(status);
    EXPECT_EQ(status->type, "STATUS");
    EXPECT_EQ(status->version, IgtlVersion::two);
    EXPECT_EQ(read_igtl_status(status->content)->words, "a test");
    EXPECT_EQ(types_of_next(two, 6, IgtlVersion::two), "PTTTTT");
    // One that says nothing is taken for an old one, after a moment.
    Client silent(server);
    EXPECT_EQ(types_of_next(silent, 7, IgtlVersion::one), "PSTTTTT");
    silent.send(message("GET_STATUS", IgtlVersion::two)); // and then says what it is
    EXPECT_EQ(silent.next("STATUS")->version, IgtlVersion::two);
}

TEST(IgtlServer, SendsTheNewestFrameAndEachOnce) {
    IgtlServer server(any_port(), {}, {});
    Client client(server);
    client.send(message("STATUS", IgtlVersion::two, igtl_status_content({})));
    std::uint64_t last = 0;
    for (std::uint64_t number = 1; number <= 100; ++number)
        server.show(frame(number));
    // However the frames fall to the ticks: ids rise, and the last one comes.
    while (last < 100) {
        const auto stylus = client.next("TRANSFORM");
        ASSERT_TRUE(stylus);
        if (stylus->device != "Stylus") continue;
        EXPECT_GT(stylus->id, last);
        last = stylus->id;
    }
    client.send(message("GET_TRANS", IgtlVersion::two, {}, "Proxy"));
    for (int i = 0; i < 4; ++i) // the rest of the batch
        client.next("TRANSFORM");
    EXPECT_EQ(client.next("TRANSFORM")->device, "Proxy"); // the answer, and no batch in between
    EXPECT_EQ(server.counts().faulty, 0u);
}

TEST(IgtlServer, AQueryForNothingIsNotAnswered) {
    IgtlServer server(any_port(), {}, {});
    Client client(server);
    client.send(message("GET_", IgtlVersion::two));
    client.send(message("GET_STATUS", IgtlVersion::two, {}, "done"));
    for (;;) {
        const auto found = client.next();
        ASSERT_TRUE(found) << "a message that cannot be read, or the end";
        EXPECT_NE(found->type, "");
        if (found->type == "STATUS" && found->device == "done") break;
    }
}

TEST(IgtlServer, AClientThatDoesNotReadIsDropped) {
    IgtlServerSettings settings = any_port();
    settings.taking_s = 0.3;
    // Far more than the buffers of the system hold.
    IgtlServer server(settings, {{"s", {1, 0, 0, 1}, mesh_of(500'000)}}, {});
    Client lazy(server);
    lazy.send(message("STATUS", IgtlVersion::two, igtl_status_content({})));
    EXPECT_TRUE(comes_true([&] { return server.counts().dropped == 1; }));
    EXPECT_TRUE(comes_true([&] { return server.counts().open == 0; })) << "just after";
}

TEST(IgtlServer, AClientThatAsksAndDoesNotReadIsDropped) {
    IgtlServer server(any_port(), {{"s", {1, 0, 0, 1}, mesh_of(500'000)}}, {});
    Client greedy(server);
    try {
        for (int i = 0; i < 2000; ++i)
            greedy.send(message("GET_POLYDATA", IgtlVersion::two));
    } catch (const boost::system::system_error&) { // it is dropped already
    }
    EXPECT_TRUE(comes_true([&] { return server.counts().dropped == 1; }));
}

TEST(IgtlServer, ASurfaceHoldsUpNoMovement) {
    std::vector<ServedSurface> surfaces;
    for (int i = 0; i < 20; ++i)
        surfaces.push_back({"s" + std::to_string(i), {1, 0, 0, 1}, mesh_of(20'000)});
    IgtlServer server(any_port(), surfaces, {});
    std::atomic<bool> goes_on{true};
    std::thread loop([&] {
        for (std::uint64_t number = 1; goes_on; ++number) {
            server.show(frame(number));
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
    });
    Client client(server);
    client.send(message("STATUS", IgtlVersion::two, igtl_status_content({})));
    std::size_t seen = 0, transforms = 0;
    while (seen < surfaces.size()) {
        const auto found = client.next();
        if (!found) break;
        seen += found->type == "POLYDATA" ? 1 : 0;
        if (seen < surfaces.size()) transforms += found->type == "TRANSFORM" ? 1 : 0;
        std::this_thread::sleep_for(std::chrono::milliseconds(20)); // it takes its time
    }
    goes_on = false;
    loop.join();
    EXPECT_EQ(seen, surfaces.size());
    EXPECT_GT(transforms, 0u);
}

TEST(IgtlServer, TellsOfTransformsOfAClient) {
    std::mutex mutex;
    std::vector<std::string> names;
    IgtlTransform last;
    IgtlServer server(any_port(), {}, [&](const std::string& name, const IgtlTransform& transform) {
        const std::lock_guard lock(mutex);
        names.push_back(name);
        last = transform;
    });
    const IgtlTransform sent = igtl_pose({{0.01, 0.02, 0.03}, {1.0, 0.0, 0.0, 0.0}});
    Client client(server);
    client.send(message("TRANSFORM", IgtlVersion::one, IgtlBytes(47), "short"));
    client.send(message("TRANSFORM", IgtlVersion::two, igtl_transform_content(sent), "Tool"));
    client.send(message("GET_STATUS", IgtlVersion::two, {}, "done"));
    while (client.next("STATUS")->device != "done") {
    }
    const std::lock_guard lock(mutex);
    EXPECT_THAT(names, testing::ElementsAre("Tool"));
    EXPECT_EQ(last, sent);
}

TEST(IgtlServer, SaysWhatIsInTheWay) {
    const IgtlServer first(any_port(), {}, {});
    IgtlServerSettings taken = any_port();
    taken.port = first.port();
    EXPECT_THAT([&] { IgtlServer(taken, {}, {}); },
                ThrowsMessage<std::runtime_error>(HasSubstr("another program has it")));
    taken.address = "somewhere";
    EXPECT_THAT([&] { IgtlServer(taken, {}, {}); },
                ThrowsMessage<std::runtime_error>(HasSubstr("is no address")));
}

} // namespace
} // namespace palpate
