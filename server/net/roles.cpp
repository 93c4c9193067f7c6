#include "server/net/roles.h"

#include <chrono>
#include <iterator>
#include <variant>

namespace strandcast {

bool may_be(Grant grant, Role role) {
  switch (grant) {
    case Grant::Viewer:
      return role == Role::Viewer;
    case Grant::Controller:
      return role == Role::Viewer || role == Role::Controller;
    case Grant::Source:
      return role == Role::Source;
    case Grant::AllButAdmin:
      return role != Role::Admin;
    case Grant::Admin:
      return true;
  }
  return false;
}

namespace {

enum class Sender { First, Anyone, Watches, Steers, Feeds, Admin };
struct Kind {
  const char* name;
  Sender sender;
};
// In the order of ClientMessage.
// schema begin: senders
// clang-format off
constexpr Kind kKinds[] = {
    {"Hello", Sender::First},
    {"MotionSamples", Sender::Feeds},
    {"WindSamples", Sender::Feeds},
    {"CameraChange", Sender::Watches},
    {"KeyframeRequest", Sender::Watches},
    {"FrameAck", Sender::Watches},
    {"Ping", Sender::Anyone},
    {"ControlCommand", Sender::Steers},
    {"SetParameter", Sender::Steers},
    {"AdminCommand", Sender::Admin},
    {"ViewerReport", Sender::Watches},
    {"ModeRequest", Sender::Watches},
    {"SceneRequest", Sender::Steers},
    {"LiveCommand", Sender::Steers},
    {"ParameterRequest", Sender::Watches},
    {"CameraCommand", Sender::Steers},
    {"StateTimesRequest", Sender::Watches},
    {"RecordCommand", Sender::Steers},
    {"WindowChange", Sender::Watches},
};
// clang-format on
// schema end
static_assert(std::size(kKinds) == std::variant_size_v<ClientMessage>);

}  // namespace

const char* message_name(const ClientMessage& message) {
  return kKinds[message.index()].name;
}

bool may_send(Role role, const ClientMessage& message) {
  switch (kKinds[message.index()].sender) {
    case Sender::First:
      return false;
    case Sender::Anyone:
      return true;
    case Sender::Watches:
      return role != Role::Source;
    case Sender::Steers:
      return role == Role::Controller || role == Role::Admin;
    case Sender::Feeds:
      return role == Role::Source || role == Role::Admin;
    case Sender::Admin:
      return role == Role::Admin;
  }
  return false;
}

bool is_token_equal(std::string_view expected, std::string_view given) {
  // No early exit: the time must not tell how many leading characters were right.
  volatile unsigned char difference = expected.size() == given.size() ? 0 : 1;
  for (size_t i = 0; i < given.size(); ++i) {
    const char wanted = expected.empty() ? '\0' : expected[i % expected.size()];
    difference = static_cast<unsigned char>(difference | (wanted ^ given[i]));
  }
  return difference == 0;
}

namespace {

const AccessToken* find_token(const std::vector<AccessToken>& tokens, std::string_view given) {
  // Every token costs the same, whether it is the one or not.
  volatile size_t found = 0;  // index + 1
  for (size_t i = 0; i < tokens.size(); ++i) {
    const size_t mask = size_t{0} - static_cast<size_t>(is_token_equal(tokens[i].secret, given));
    found = (found & ~mask) | ((i + 1) & mask);
  }
  return found == 0 ? nullptr : &tokens[found - 1];
}

const char* article_of(Role role) {
  return role == Role::Admin ? "an" : "a";
}

bool has_expired(const AccessToken& token, int64_t unix_s) {
  return token.expires_unix_s != 0 && unix_s >= token.expires_unix_s;
}

}  // namespace

int64_t unix_time_s() {
  return std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

std::optional<Grant> find_grant(const std::vector<AccessToken>& tokens, std::string_view given,
                                int64_t unix_s) {
  const AccessToken* token = find_token(tokens, given);
  if (token == nullptr || has_expired(*token, unix_s)) return std::nullopt;
  return token->grant;
}

Status check_role(const std::vector<AccessToken>& tokens, const Hello& hello, int64_t unix_s) {
  if (tokens.empty()) {
    if (hello.role != Role::Admin) return {};
    return make_error(ErrorCode::Unsupported,
                      "An admin needs an admin's token, and this server has none (--token-file).");
  }
  const AccessToken* token = find_token(tokens, hello.token);
  if (token == nullptr) return make_error(ErrorCode::Unauthorized, "The token is wrong or missing.");
  if (has_expired(*token, unix_s))
    return make_error(ErrorCode::Unauthorized, "This token has expired: ask for a new one.");
  if (!may_be(token->grant, hello.role))
    return make_error(ErrorCode::Unsupported, "This token is good for {}, not for {} {}.",
                      to_string(token->grant), article_of(hello.role), to_string(hello.role));
  return {};
}

Status check_stay(const std::vector<AccessToken>& tokens, const Hello& hello, int64_t unix_s) {
  if (tokens.empty()) return {};
  const AccessToken* token = find_token(tokens, hello.token);
  if (token == nullptr)
    return make_error(ErrorCode::Unauthorized, "This session's token was taken back: ask for a new one.");
  if (has_expired(*token, unix_s))
    return make_error(ErrorCode::Unauthorized, "This session's token has expired: ask for a new one.");
  if (!may_be(token->grant, hello.role))
    return make_error(ErrorCode::Unsupported, "This session's token is good for {} now, no longer for {} {}.",
                      to_string(token->grant), article_of(hello.role), to_string(hello.role));
  return {};
}

int64_t expiry_of(const std::vector<AccessToken>& tokens, std::string_view given) {
  const AccessToken* token = find_token(tokens, given);
  return token != nullptr ? token->expires_unix_s : 0;
}

const char* to_string(Grant grant) {
  switch (grant) {
    case Grant::Viewer:
      return "viewer";
    case Grant::Controller:
      return "controller";
    case Grant::Source:
      return "source";
    case Grant::AllButAdmin:
      return "all but admin";
    case Grant::Admin:
      return "admin";
  }
  return "unknown";
}

}  // namespace strandcast
