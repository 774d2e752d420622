// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/internal/live_answer.h>

#include <algorithm>
#include <cstdint>
#include <random>

#include <boost/beast/websocket.hpp>
#include <fmt/format.h>

namespace palpate::internal {
namespace {

namespace http = boost::beast::http;

/// In a time that does not tell how much of it is right.
bool is_same(std::string_view a, std::string_view b) {
    if (a.size() != b.size()) return false;
    unsigned differing = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        differing |= static_cast<unsigned>(a[i] ^ b[i]);
    return differing == 0;
}

std::string_view view_of(boost::beast::string_view text) { return {text.data(), text.size()}; }

/// "localhost" of "localhost:8080".
std::string_view name_of(std::string_view host) {
    if (host.starts_with('[')) return host.substr(0, host.find(']') + 1);
    return host.substr(0, host.rfind(':'));
}

/// A name of this computer for itself, or the address that was asked for: no name that another
/// site's DNS may lead here.
bool is_own(std::string_view host, std::string_view address) {
    const std::string_view name = name_of(host);
    return name == "127.0.0.1" || name == "localhost" || name == "[::1]" || name == address ||
           name == fmt::format("[{}]", address) ||
           // On every address, the token alone is left to ask for.
           address == "0.0.0.0" || address == "::";
}

/// An answer without a body yet.
LiveResponse answered(http::status status, const char* type) {
    constexpr unsigned kVersion = 11; // HTTP 1.1
    LiveResponse response(status, kVersion);
    response.keep_alive(false);
    response.set(http::field::content_type, type);
    response.set(http::field::cache_control, "no-store");
    response.set("Referrer-Policy", "no-referrer"); // the link has the token
    response.set("X-Content-Type-Options", "nosniff");
    return response;
}

LiveAnswer refused(http::status status, const char* words) {
    LiveAnswer answer{answered(status, "text/plain; charset=utf-8")};
    answer.response.body() = words;
    answer.response.prepare_payload();
    return answer;
}

LiveAnswer socket_answer(const LiveRequest& request, std::string_view host) {
    if (!boost::beast::websocket::is_upgrade(request))
        return refused(http::status::not_found, "This is for the page's WebSocket alone.\n");
    // The same host and port as the page's, through whichever port of a tunnel.
    if (view_of(request[http::field::origin]) != fmt::format("http://{}", host))
        return refused(http::status::forbidden, "This page is not of this server.\n");
    LiveAnswer answer;
    answer.is_socket = true;
    return answer;
}

} // namespace

LiveAnswer live_answer(const LiveRequest& request, std::string_view token, std::string_view address,
                       const std::string& page) {
    const std::string_view target = view_of(request.target());
    const std::string_view given = target.substr(0, std::min(target.size(), token.size() + 1));
    const std::string_view rest = target.substr(given.size());
    const std::string_view host = view_of(request[http::field::host]);
    if (!is_same(given, fmt::format("/{}", token)) || (rest != "/" && rest != "/socket") ||
        !is_own(host, address))
        return refused(http::status::not_found,
                       "Nothing is here. Use the link that palpate view printed.\n");
    if (rest == "/socket") return socket_answer(request, host);
    if (request.method() != http::verb::get)
        return refused(http::status::method_not_allowed, "The page can be read, and no more.\n");
    LiveAnswer answer{answered(http::status::ok, "text/html; charset=utf-8")};
    answer.response.set("Content-Security-Policy",
                        fmt::format("default-src 'none'; script-src 'unsafe-inline' blob:; "
                                    "style-src 'unsafe-inline'; img-src data: blob:; worker-src "
                                    "blob:; connect-src 'self' ws://{}; base-uri 'none'; "
                                    "form-action 'none'; frame-ancestors 'none'",
                                    host));
    answer.response.body() = page;
    answer.response.prepare_payload();
    return answer;
}

std::string random_token() {
    std::random_device random;
    std::string token;
    for (int i = 0; i < 4; ++i)
        token += fmt::format("{:08x}", static_cast<std::uint32_t>(random()));
    return token;
}

} // namespace palpate::internal
