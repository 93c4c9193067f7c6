// What tests of the client connect with.
#pragma once

#include "common/client/viewer_client.h"

namespace strandcast::test {

inline ClientConfig config_for(uint16_t port) {
  ClientConfig config;
  config.address = {"127.0.0.1", port};
  config.hello.name = "test";
  return config;
}

}  // namespace strandcast::test
