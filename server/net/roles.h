// Roles: what a token permits, and which messages a role may send. Pure functions, any thread.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/wire/messages.h"

namespace strandcast {

inline constexpr size_t kMinTokenCharacters = 16;  // held to where tokens are read

/// Permission of a token. AllButAdmin belongs to a token file of the plain form: one token without a role.
enum class Grant { Viewer, Controller, Source, AllButAdmin, Admin };

struct AccessToken {
  std::string secret;  // never logged, never sent
  Grant grant = Grant::Viewer;
  int64_t expires_unix_s = 0;  // good before this second of the system's clock; 0 = for ever
};

/// Returns the seconds since 1970 by the system's clock.
int64_t unix_time_s();

/// Returns whether a token permits a role. A controller's token also permits a viewer, an admin's every role.
bool may_be(Grant grant, Role role);

/// Returns the type of a message by name, as WIRE.md has it.
const char* message_name(const ClientMessage& message);

/// Returns whether a role may send a message; Hello is sent before there is a role.
bool may_send(Role role, const ClientMessage& message);

/// Compares tokens in a time that depends only on the length of `given`.
bool is_token_equal(std::string_view expected, std::string_view given);

/// Returns what `given` permits; empty if it is no valid token. Compares with all tokens, whichever matches.
/// An expired token permits nothing.
std::optional<Grant> find_grant(const std::vector<AccessToken>& tokens, std::string_view given,
                                int64_t unix_s = unix_time_s());

/// Checks the role that a client asks for. Unauthorized for a wrong or expired token,
/// Unsupported for a role that it does not permit. Without tokens every role except Admin is free.
Status check_role(const std::vector<AccessToken>& tokens, const Hello& hello, int64_t unix_s = unix_time_s());

/// Checks whether a session with this Hello may stay under the present tokens. Unauthorized if its token was
/// revoked or has expired, Unsupported if it no longer permits the role.
Status check_stay(const std::vector<AccessToken>& tokens, const Hello& hello, int64_t unix_s = unix_time_s());

/// Returns when this token expires, as in AccessToken; 0 also for an unknown token.
int64_t expiry_of(const std::vector<AccessToken>& tokens, std::string_view given);

const char* to_string(Grant grant);

}  // namespace strandcast
