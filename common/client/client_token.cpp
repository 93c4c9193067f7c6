#include "common/client/client_token.h"

#include <map>
#include <sstream>
#include <vector>

#include "common/base/file.h"

namespace strandcast {

Result<std::string> load_token(const std::filesystem::path& path, Role role) {
  constexpr uint64_t kMaxTokenFileBytes = 4096;
  ASSIGN_OR_RETURN(const std::string text, load_text(path, kMaxTokenFileBytes));
  std::map<std::string, std::string> token_of_role;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string first, second;
    words >> first >> second;
    if (first.empty() || first.starts_with('#')) continue;
    if (second.empty()) return first;
    token_of_role.emplace(first, second);
  }
  if (token_of_role.empty())
    return at(path.string(), make_error(ErrorCode::BadInput, "there is no token in this file"));
  // A controller may watch too, an admin may do everything.
  std::vector<Role> serving = {role, Role::Admin};
  if (role == Role::Viewer) serving = {Role::Viewer, Role::Controller, Role::Admin};
  for (const Role one : serving)
    if (const auto found = token_of_role.find(to_string(one)); found != token_of_role.end())
      return found->second;
  return at(path.string(),
            make_error(ErrorCode::NotFound, "there is no token for a {} in this file{}", to_string(role),
                       role == Role::Controller ? " (--view-only asks for less)" : ""));
}

}  // namespace strandcast
