// What is inside a TlsContext. Private to common/net.
#pragma once

#include <boost/asio/ssl/context.hpp>

#include "common/net/tls_context.h"

namespace strandcast {

class TlsContext {
 public:
  explicit TlsContext(boost::asio::ssl::context::method method) : ssl(method) {}
  boost::asio::ssl::context ssl;
};

}  // namespace strandcast
