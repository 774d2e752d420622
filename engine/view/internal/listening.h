// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include <boost/asio/ip/tcp.hpp>

namespace palpate::internal {

/// Lets a server listen at an address of this computer, in digits, and a port; 0: any that is free.
/// Returns the port. Throws std::runtime_error that names both, and `another`: what to do where
/// another program has the port.                                                        [setup]
std::uint16_t listen_at(boost::asio::ip::tcp::acceptor& acceptor, const std::string& address,
                        std::uint16_t port, const char* another);

} // namespace palpate::internal
