// libFuzzer entry: the file with the server's tokens, and who gets in with them. The first line is the token
// a client gives, its first byte the role it asks for.
#include <algorithm>

#include "common/base/check.h"
#include "server/net/token_file.h"
#include "tests/fuzz/fuzz_input.h"

namespace strandcast::token_file_fuzz {

extern "C" int FUZZ_ENTRY(token_file)(const uint8_t* data, size_t size) {
  FuzzInput input(data, size);
  constexpr int kRoles = 4;
  Hello hello;
  hello.role = static_cast<Role>(input.take<uint8_t>() % kRoles);
  hello.token = input.take_line();
  const auto tokens = parse_tokens(input.take_rest_as_text());
  if (!tokens) return 0;
  CHECK(!tokens->empty());
  const auto again = parse_tokens(to_text(*tokens));
  CHECK(again.ok() && again->size() == tokens->size());
  constexpr int64_t kNowS = 1'800'000'000;
  const auto is_good = [](const AccessToken& token) {
    return token.expires_unix_s == 0 || token.expires_unix_s > kNowS;
  };
  for (size_t i = 0; i < tokens->size(); ++i) {
    CHECK((*again)[i].expires_unix_s == (*tokens)[i].expires_unix_s);
    CHECK((*again)[i].secret == (*tokens)[i].secret && (*again)[i].grant == (*tokens)[i].grant);
    CHECK(!(*tokens)[i].secret.empty() && is_token_equal((*tokens)[i].secret, (*tokens)[i].secret));
    CHECK(is_token_equal((*tokens)[i].secret, hello.token) == ((*tokens)[i].secret == hello.token));
  }
  const bool may_enter = std::any_of(tokens->begin(), tokens->end(), [&](const AccessToken& token) {
    return token.secret == hello.token && is_good(token) && may_be(token.grant, hello.role);
  });
  const bool is_known = std::any_of(tokens->begin(), tokens->end(), [&](const AccessToken& token) {
    return token.secret == hello.token && is_good(token);
  });
  CHECK(find_grant(*tokens, hello.token, kNowS).has_value() == is_known);
  const bool is_let_in = check_role(*tokens, hello, kNowS).ok();
  CHECK(!is_let_in || may_enter);
  return 0;
}

}  // namespace strandcast::token_file_fuzz
