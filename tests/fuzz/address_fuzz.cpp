// libFuzzer entry: HOST:PORT as typed. What is read must come back equal from its own text.
#include "common/client/address.h"

#include "common/base/check.h"
#include "tests/fuzz/fuzz_input.h"

namespace strandcast::address_fuzz {

extern "C" int FUZZ_ENTRY(address)(const uint8_t* data, size_t size) {
  const auto address = parse_address(FuzzInput(data, size).take_rest_as_text());
  if (!address) return 0;
  CHECK(!address->host.empty() && address->port != 0);
  const auto again = parse_address((address->is_tls ? "wss://" : "") + address->to_string());
  CHECK(again.ok() && *again == *address);
  return 0;
}

}  // namespace strandcast::address_fuzz
