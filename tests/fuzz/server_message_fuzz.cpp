// libFuzzer entry: what a server sends. What decodes must encode to bytes that decode to the same message.
#include "common/base/check.h"
#include "common/wire/messages.h"
#include "tests/fuzz/fuzz_input.h"

namespace strandcast::server_message_fuzz {

extern "C" int FUZZ_ENTRY(server_message)(const uint8_t* data, size_t size) {
  const auto message = decode_server_message(FuzzInput(data, size).take_rest());
  if (!message) return 0;
  const std::vector<std::byte> bytes = encode(*message);
  CHECK(bytes.size() <= kMaxControlBytes);
  const auto again = decode_server_message(bytes);
  CHECK(again.ok() && again->index() == message->index());
  CHECK(encode(*again) == bytes);
  return 0;
}

}  // namespace strandcast::server_message_fuzz
