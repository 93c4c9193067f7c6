// Roles: what a token lets its bearer be, and which messages a role may send. Pure functions, any thread.
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

/// What a token is good for. AllButAdmin: a token file of the plain form, one token and no role.
enum class Grant { Viewer, Controller, Source, AllButAdmin, Admin };

struct AccessToken {
  std::string secret;  // never logged, never sent
  Grant grant = Grant::Viewer;
  int64_t expires_unix_s = 0;  // good before this second of the system's clock; 0 = for ever
};

/// Seconds since 1970 by the system's clock.
int64_t unix_time_s();

/// A controller's token is good for a viewer too, an admin's for everything.
bool may_be(Grant grant, Role role);

/// Which role may send what; Hello comes before there is a role.
bool may_send(Role role, const ClientMessage& message);

/// Compares in a time that depends on the length of `given` only.
bool is_token_equal(std::string_view expected, std::string_view given);

/// What `given` is good for; nothing when it is none of the tokens. Looks at all of them, wherever the match
/// is. An expired one is good for nothing.
std::optional<Grant> find_grant(const std::vector<AccessToken>& tokens, std::string_view given,
                                int64_t unix_s = unix_time_s());

/// Lets a client in as the role that it asks for. Unauthorized for a wrong or expired token, BadInput for a
/// role beyond it. Without tokens every role but Admin is free.
Status check_role(const std::vector<AccessToken>& tokens, const Hello& hello, int64_t unix_s = unix_time_s());

/// Whether a session that was let in with this Hello may stay, the tokens being these now. The error ends it:
/// Unauthorized where its token was taken back or has expired, BadInput where it is good for less than the
/// role.
Status check_stay(const std::vector<AccessToken>& tokens, const Hello& hello, int64_t unix_s = unix_time_s());

/// When this token ends, as in AccessToken; 0 also for one that is not among them.
int64_t expiry_of(const std::vector<AccessToken>& tokens, std::string_view given);

const char* to_string(Grant grant);

}  // namespace strandcast
