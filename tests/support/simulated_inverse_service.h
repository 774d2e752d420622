// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <palpate/drivers/inverse3_device.h>
#include <palpate/geometry/vec.h>

namespace palpate::test {

/// What a client's message meant, read by the service's own parser. Frame of the service.
struct HeardCommand {
    std::uint64_t number = 0; ///< of this connection, from 0
    std::string device_id;
    std::string key;          ///< of the force: "values", "vector"; empty: the message had none
    Vec3 force{0.0};          ///< N
    double time_s = 0.0;      ///< on the steady clock
    bool has_session = false; ///< it configures the session
};

/// A frame that the service sends.
struct ServiceFrame {
    std::string text;
    bool is_binary = false;
    std::chrono::milliseconds after{0}; ///< waits so long before
};

/// Haply's Inverse Service in a program, on loopback: sends what it has to whoever connects, and
/// answers each message with a state, as the documents say; or does what a test wants instead.
class SimulatedInverseService {
public:
    enum class Version : std::uint8_t { v3_1, v3_5 };
    /// Frames that answer a command; none: it is swallowed.
    using Behaviour = std::function<std::vector<ServiceFrame>(const HeardCommand&)>;

    /// Listens at a port that is free.
    explicit SimulatedInverseService(Version version = Version::v3_5,
                                     std::vector<std::string> ids = {"049D"});
    ~SimulatedInverseService();
    SimulatedInverseService(const SimulatedInverseService&) = delete;
    SimulatedInverseService& operator=(const SimulatedInverseService&) = delete;

    std::uint16_t port() const { return port_; }
    /// "?port=N", as addresses take it.
    std::string options() const { return "?port=" + std::to_string(port_); }
    /// Of what is answered from now on; empty: as documented.
    void behave(Behaviour behaviour);
    /// The first message of connections from now on; empty: as documented.
    void greet_with(std::string text);
    /// Connections from now on get states and no pongs; what they say is not kept.
    void answer_no_pings() { pongs_.store(Pongs::none); }
    /// The same with pongs, each with one that nobody asked for right behind it.
    void add_pongs() { pongs_.store(Pongs::one_too_many); }
    /// Ends all connections and does not listen any more.
    void stop();
    /// Listens again, at the same port.
    void restart();
    /// Ends the connections that there are.
    void hang_up();

    void move_to(const Vec3& position); ///< of every device, frame of the service, m
    /// All that was heard since the last time that this was asked.
    std::vector<HeardCommand> heard();
    int connections() const { return connections_.load(); } ///< that were greeted

    /// A state message as the version's documents have it.
    std::string state_message() const;
    /// The first message likewise.
    std::string first_message() const;

private:
    class Server;
    enum class Pongs : std::uint8_t { right, none, one_too_many };
    std::string message(bool is_first) const;

    Version version_;
    std::vector<std::string> ids_;
    std::uint16_t port_ = 0;
    std::atomic<int> connections_{0};
    std::atomic<Pongs> pongs_{Pongs::right};
    std::unique_ptr<Server> server_;
};

/// Of a device over it; `more`: options behind those that lead there, as "&force_n=4".
inline Inverse3Device::Settings settings_of(const SimulatedInverseService& service,
                                            const std::string& more = "") {
    Inverse3Device::Settings settings;
    settings.address = inverse3_address(service.options() + more);
    settings.reconnect_s = 0.05; // nobody waits a second here
    // A loaded machine is late, but its service is not broken.
    settings.stale_after_s = 0.2;
    settings.lost_after_s = 0.6;
    return settings;
}

} // namespace palpate::test
