// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/internal/listening.h>

#include <stdexcept>

#include <fmt/format.h>

namespace palpate::internal {
namespace asio = boost::asio;

std::uint16_t listen_at(asio::ip::tcp::acceptor& acceptor, const std::string& address,
                        std::uint16_t port, const char* another) {
    const auto refuse = [&](const std::string& why, const char* remedy) {
        throw std::runtime_error(fmt::format("port {} of {}: {}; {}", port, address, why, remedy));
    };
    boost::system::error_code error;
    const auto here = asio::ip::make_address(address, error);
    if (error) refuse("is no address", "give one in digits, as 127.0.0.1");
    const asio::ip::tcp::endpoint endpoint(here, port);
    acceptor.open(endpoint.protocol(), error);
    if (!error) acceptor.set_option(asio::socket_base::reuse_address(true), error);
    if (!error) acceptor.bind(endpoint, error);
    if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
    if (error == asio::error::address_in_use) refuse("another program has it", another);
    if (error == asio::error::access_denied)
        refuse("is for the system alone", "give one from 1024 on");
    if (error) refuse(error.message(), "give an address of this computer and a free port");
    return acceptor.local_endpoint().port();
}

} // namespace palpate::internal
