// The file with the server's tokens: one line "role token" per role, made when it does not exist. Any thread.
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

/// Reads the file, or makes it with fresh tokens of 128 bits for every role, readable by its owner only.
/// Unauthorized for a file that others may read or write, BadInput for one that cannot be understood; the
/// error names the file and never what is in it.
Result<TokenFile> open_token_file(const std::filesystem::path& path);

/// Lines "viewer TOKEN", "controller TOKEN", "source TOKEN", "admin TOKEN" in any order and number, each with
/// "expires=2027-01-31" or "expires=2027-01-31T18:00:00Z" behind it where it ends (UTC), empty lines and #
/// comments; or a single token without a role, good for all but admin.
Result<std::vector<AccessToken>> parse_tokens(const std::string& text);

/// Inverse of parse_tokens().
std::string to_text(const std::vector<AccessToken>& tokens);

}  // namespace strandcast
