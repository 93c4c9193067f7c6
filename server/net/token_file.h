// The file with the server's tokens: one line "role token" per role, created if it does not exist. Any
// thread.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server/net/roles.h"

namespace strandcast {

struct TokenFile {
  std::vector<AccessToken> tokens;
  bool is_new = false;  // just made: to be shown once
};

/// Reads the file, or creates it with new tokens of 128 bits for every role, readable by its owner only.
/// Unauthorized for a file that others may read or write, BadInput for a malformed one. The error names the
/// file and never its content.
Result<TokenFile> open_token_file(const std::filesystem::path& path);

/// Parses lines "viewer TOKEN", "controller TOKEN", "source TOKEN" and "admin TOKEN" in any order and number.
/// A line may end in an expiry "expires=2027-01-31" or "expires=2027-01-31T18:00:00Z" (UTC). Empty lines and
/// # comments are ignored. A single token without a role permits all roles but admin.
Result<std::vector<AccessToken>> parse_tokens(const std::string& text);

/// Inverse of parse_tokens().
std::string to_text(const std::vector<AccessToken>& tokens);

}  // namespace strandcast
