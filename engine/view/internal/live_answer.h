// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <boost/beast/http.hpp>

namespace palpate::internal {

using LiveRequest = boost::beast::http::request<boost::beast::http::empty_body>;
using LiveResponse = boost::beast::http::response<boost::beast::http::string_body>;

/// What a request gets: the page, or words and a status that say why not.                 [setup]
struct LiveAnswer {
    LiveResponse response;
    bool is_socket = false; ///< it opens the page's socket, and `response` is not sent
};

/// Only GET /TOKEN/ and the upgrade of /TOKEN/socket are answered; the second only to a page that
/// came from here. `address` is the one that is listened on.                              [setup]
LiveAnswer live_answer(const LiveRequest& request, std::string_view token, std::string_view address,
                       const std::string& page);

/// 128 random bits, hexadecimal.                                                          [setup]
std::string random_token();

} // namespace palpate::internal
