// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <palpate/drivers/haptic_device.h>
#include <palpate/drivers/igtl_message.h>
#include <palpate/drivers/transform_device.h>

namespace palpate {

/// What stands behind "igtl:" in a scene: `TRANSFORM`, `TRANSFORM@HOST` or `TRANSFORM@HOST:PORT`.
struct IgtlAddress {
    std::string transform;               ///< the TRANSFORM's name, 1 to 20 bytes
    std::string host;                    ///< of a server of OpenIGTLink; empty: none is named
    std::uint16_t port = kIgtlUsualPort; ///< of that server
};

/// Takes an address apart. Throws std::invalid_argument "igtl:..: what is wrong; what to do".
/// [setup]
IgtlAddress igtl_address(const std::string& text);

/// A tool whose pose a server of OpenIGTLink sends as a TRANSFORM, as PLUS or 3D Slicer do: the
/// client's side, in a thread of its own. A connection that is lost is looked for each second;
/// until then the state is stale (TransformDevice).
class IgtlDevice final : public HapticDevice {
public:
    /// How long things may take.
    struct Patience {
        double connect_s = 5.0;   ///< open(): until the server answers, > 0
        double reconnect_s = 1.0; ///< between two looks for a server that is gone, > 0
    };

    /// Connects to nothing yet. `address` names a host.                                  [setup]
    explicit IgtlDevice(const IgtlAddress& address) : IgtlDevice(address, Patience{}) {}
    /// The same with another patience.                                                   [setup]
    IgtlDevice(const IgtlAddress& address, const Patience& patience);
    /// Closes.                                                                           [setup]
    ~IgtlDevice() override;

    DeviceProperties properties() const override;
    /// Connects. Throws std::runtime_error where no server answers.                      [setup]
    void open() override;
    void close() noexcept override;
    bool read(DeviceState& state) noexcept override;
    void write(const Vec3&) noexcept override {} ///< it has no motors

    /// What was of no use, in words; empty: nothing was.                                 [setup]
    std::string complaint() const;
    /// Whether no pose ever came, or the server was gone when it was closed.             [setup]
    bool has_failed() const;

private:
    class Client;
    IgtlAddress address_;
    Patience patience_;
    TransformDevice tool_;
    std::unique_ptr<Client> client_; ///< null: closed
    bool is_gone_ = false;           ///< the server, when it was closed
};

} // namespace palpate
