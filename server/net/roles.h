// Roles: what a token lets its bearer be, and which messages a role may send. Pure functions, any thread.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/wire/messages.h"

namespace strandcast {

inline constexpr size_t kMinTokenCharacters = 16;  // held to where tokens are read

/// What a token is good for. AllButAdmin: a token file of the plain form, one token and no role.
enum class Grant { Viewer, Controller, Source, AllButAdmin, Admin };

struct AccessToken {
  std::string secret;  // never logged, never sent
  Grant grant = Grant::Viewer;
};

/// A controller's token is good for a viewer too, an admin's for everything.
bool may_be(Grant grant, Role role);

/// Which role may send what; Hello comes before there is a role.
bool may_send(Role role, const ClientMessage& message);

/// Compares in a time that depends on the length of `given` only.
bool is_token_equal(std::string_view expected, std::string_view given);

/// What `given` is good for; nothing when it is none of the tokens. Looks at all of them, wherever the match
/// is.
std::optional<Grant> find_grant(const std::vector<AccessToken>& tokens, std::string_view given);

/// Lets a client in as the role that it asks for. Unauthorized for a wrong token, BadInput for a role beyond
/// it. Without tokens every role but Admin is free.
Status check_role(const std::vector<AccessToken>& tokens, const Hello& hello);

const char* to_string(Grant grant);

}  // namespace strandcast
