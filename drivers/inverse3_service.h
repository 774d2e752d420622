// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace palpate {

/// What stands behind "inverse3" in a scene: nothing, :DEVICE_ID, ?key=value&.., or both.
struct Inverse3Address {
    std::string device_id;          ///< as the service calls it; empty: the first that it has
    std::string host = "127.0.0.1"; ///< key host: the service's computer, as a numeric address
    std::uint16_t port = 10001;     ///< key port: of the service's format 3.1 and later, > 0
    std::string grip_id;  ///< key grip: the VerseGrip in the hand; empty: the only one there is
    double force_n = 3.0; ///< key force_n: longest force that is sent, N, (0, 10]. What an arm
                          ///< holds is not published where we looked
};

/// Takes an address apart, without "inverse3". Throws std::runtime_error that says what is wrong
/// with it and what to do.                                                              [setup]
Inverse3Address inverse3_address(const std::string& text);

/// A device of an Inverse Service, as the service tells of it.
struct ListedInverse3 {
    std::string device_id;     ///< as addresses take it
    std::string type;          ///< "inverse3", "minverse"; empty: not told
    std::string handedness;    ///< "right" or "left", how it is built; empty: not told
    bool is_calibrated = true; ///< false: it has to be, before its positions are of use
    bool has_power = true;     ///< false: it cannot push
    bool is_in_use = false;    ///< another program sends it forces, too
};

/// An Inverse Service that was asked what it has.
struct InverseService {
    /// Who answered.
    enum class Answer : std::uint8_t {
        nobody,   ///< no program listens there, or none that answers in time
        stranger, ///< something listens, and is no Inverse Service of these versions
        service   ///< `devices` are its
    };
    Answer answer = Answer::nobody;      ///< who it was
    std::string reason;                  ///< in words, where it was no service
    std::vector<ListedInverse3> devices; ///< where it was one
    std::vector<std::string> grips;      ///< ids of the VerseGrips
};

/// Asks the service at an address what it has, and sends it no force. Takes at most twice
/// `patience_s`, and nearly nothing where nobody listens.                               [setup]
InverseService ask_inverse_service(const Inverse3Address& address, double patience_s);

} // namespace palpate
