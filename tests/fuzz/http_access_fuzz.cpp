// libFuzzer entry: who may talk to the server. Lines: Host header, Origin header, address the connection came
// in on, a name that is allowed besides, Accept-Encoding, If-None-Match, the target.
#include <algorithm>

#include "common/base/check.h"
#include "server/net/access.h"
#include "server/net/page.h"
#include "tests/fuzz/fuzz_input.h"

namespace strandcast::http_access_fuzz {

extern "C" int FUZZ_ENTRY(http_access)(const uint8_t* data, size_t size) {
  FuzzInput input(data, size);
  const std::string host = input.take_line();
  const std::string origin = input.take_line();
  const std::string local_address = input.take_line();
  const std::string allowed = input.take_line();

  const std::string name = host_name_of(host);
  CHECK(name.size() <= host.size());
  CHECK(std::none_of(name.begin(), name.end(), [](char c) { return c >= 'A' && c <= 'Z'; }));
  const bool is_remote_allowed = is_host_allowed(host, local_address, false, {allowed});
  if (is_remote_allowed) {
    CHECK(!name.empty());
    CHECK(name == local_address || name == host_name_of(allowed) || name.size() == allowed.size());
    CHECK(is_host_allowed(host, local_address, true, {allowed}));
  }
  CHECK(is_origin_allowed("", host, {}));
  CHECK(is_origin_allowed("http://" + host, host, {}) && is_origin_allowed("https://" + host, host, {}));
  CHECK(!is_origin_allowed("http://" + host + ".evil.example", host, {}));
  if (!origin.empty()) {
    constexpr size_t kHttpChars = 7, kHttpsChars = 8;  // of the scheme
    const size_t name_chars = host.size();
    if (is_origin_allowed(origin, host, {}))
      CHECK(origin.size() == name_chars + kHttpChars || origin.size() == name_chars + kHttpsChars);
    CHECK(is_origin_allowed(origin, host, {origin}));
    if (is_origin_allowed(origin, host, {allowed}))
      CHECK(is_origin_allowed(origin, host, {}) || origin.size() == allowed.size());
  }

  const std::string coding = input.take_line();
  const std::string tags = input.take_line();
  const std::string target = input.take_line();
  const PageCoding best = best_coding(coding);
  CHECK(best != PageCoding::Gzip || coding.find('*') != std::string::npos || coding.size() >= 4);
  CHECK(best != PageCoding::Brotli || coding.size() >= 2);
  CHECK(best_coding("gzip," + coding) != PageCoding::Plain);
  CHECK(best_coding("br," + coding) == PageCoding::Brotli);
  CHECK(best_coding("gzip;q=0, br;q=0," + coding) == PageCoding::Plain);
  CHECK(names_tag("\"a\"," + tags, "\"a\""));
  CHECK(!names_tag(tags, "\"a\"") || tags.find('*') != std::string::npos ||
        tags.find("\"a\"") != std::string::npos);
  const std::string_view path = path_of_target(target);
  CHECK(target.starts_with(path) && path.find('?') == std::string_view::npos);
  const PageFile page{.path = "/"};
  CHECK((find_page_file({&page, 1}, path) != nullptr) == (path == "/"));
  return 0;
}

}  // namespace strandcast::http_access_fuzz
