// libFuzzer entry: control messages of both directions. What decodes must encode to something that decodes
// again.
#include <span>

#include "common/base/check.h"
#include "common/wire/messages.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace strandcast;
  const auto bytes = std::as_bytes(std::span(data, size));
  if (const auto message = decode_client_message(bytes)) CHECK(decode_client_message(encode(*message)).ok());
  if (const auto message = decode_server_message(bytes)) CHECK(decode_server_message(encode(*message)).ok());
  return 0;
}
