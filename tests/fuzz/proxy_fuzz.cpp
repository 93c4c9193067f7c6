// libFuzzer entry: who stands behind a proxy. A line with a range of addresses that are our proxies, a line
// with an X-Forwarded-For, then a PROXY header.
#include "common/base/check.h"
#include "server/net/proxy.h"
#include "tests/fuzz/fuzz_input.h"

namespace strandcast::proxy_fuzz {
namespace {

void check_address(const IpAddress& address) {
  const auto again = IpAddress::parse(address.to_string());
  CHECK(again && *again == address);
  CHECK(!address.key().empty());
}

void check_forwarded(const std::string& field, const std::vector<AddressRange>& proxies) {
  const auto client = forwarded_client(field, proxies);
  if (!client) return;
  check_address(*client);
  // What a client writes before it is nobody's business, unless all behind it are proxies of ours.
  const auto behind_more = forwarded_client("nonsense," + field, proxies);
  CHECK(is_in(proxies, *client) ? !behind_more : behind_more && *behind_more == *client);
}

void check_header(std::span<const std::byte> bytes) {
  const auto peer = parse_proxy_header(bytes);
  if (!peer) return;
  CHECK(bytes.size() <= kMaxProxyBytes);
  CHECK(*proxy_header_bytes(bytes.first(kProxyFixedBytes)) == bytes.size());
  CHECK(!parse_proxy_header(bytes.first(bytes.size() - 1)));
  if (!*peer) return;
  check_address((*peer)->address);
  check_address((*peer)->local_address);
}

}  // namespace

extern "C" int FUZZ_ENTRY(proxy)(const uint8_t* data, size_t size) {
  FuzzInput input(data, size);
  std::vector<AddressRange> proxies;
  if (const auto range = parse_address_range(input.take_line())) {
    CHECK(range->contains(range->first));
    check_address(range->first);
    proxies.push_back(*range);
  }
  check_forwarded(input.take_line(), proxies);
  check_header(input.take_rest());
  return 0;
}

}  // namespace strandcast::proxy_fuzz
