// The Boost headers of this folder, precompiled once. Included by its .cpp files and *_private headers only.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

#include "common/net/net_stream_private.h"

namespace strandcast::net {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
namespace websocket = boost::beast::websocket;
using tcp = boost::asio::ip::tcp;

/// Converts Beast's view of a text to the standard library's.
inline std::string_view view(beast::string_view text) {
  return {text.data(), text.size()};
}

}  // namespace strandcast::net
