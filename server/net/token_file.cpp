#include "server/net/token_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <optional>
#include <sstream>
#include <string_view>

namespace strandcast {
namespace {

constexpr size_t kMaxTokenFileBytes = 4'096;
constexpr size_t kTokenBytes = 16;  // 128 bits
constexpr mode_t kOwnerOnly = 0600;
constexpr std::array kNamedGrants = {Grant::Viewer, Grant::Controller, Grant::Source, Grant::Admin};

/// A file descriptor closed at the end of its scope.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number() const { return number_; }

 private:
  const int number_;
};

Result<std::string> make_secret() {
  std::array<unsigned char, kTokenBytes> random{};
  if (getentropy(random.data(), random.size()) != 0)
    return make_error(ErrorCode::Unavailable, "the system has no random numbers: {}", std::strerror(errno));
  std::string secret;
  for (const unsigned char byte : random) secret += fmt::format("{:02x}", byte);
  return secret;
}

Status write_all(int descriptor, const std::string& text) {
  for (size_t written = 0; written < text.size();) {
    const ssize_t size = write(descriptor, text.data() + written, text.size() - written);
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return make_error(ErrorCode::Unavailable, "cannot be written: {}", std::strerror(errno));
    written += static_cast<size_t>(size);
  }
  return {};
}

Result<TokenFile> make_token_file(const std::filesystem::path& path) {
  TokenFile made;
  made.is_new = true;
  for (const Grant grant : kNamedGrants) {
    ASSIGN_OR_RETURN(std::string secret, make_secret());
    made.tokens.push_back({std::move(secret), grant});
  }
  const Descriptor file(open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kOwnerOnly));
  if (file.number() < 0)
    return make_error(ErrorCode::BadInput, "cannot make this token file: {}", std::strerror(errno));
  RETURN_IF_ERROR(write_all(file.number(), to_text(made.tokens)));
  return made;
}

Result<std::string> read_private(int descriptor) {
  struct stat facts {};
  if (fstat(descriptor, &facts) != 0 || !S_ISREG(facts.st_mode))
    return make_error(ErrorCode::BadInput, "the token file is no regular file");
  constexpr mode_t kModeBits = 0777;
  if ((facts.st_mode & kModeBits & ~kOwnerOnly) != 0)
    return make_error(ErrorCode::Unauthorized,
                      "the token file has mode {:04o}, so that others may read or change it (chmod 600 FILE)",
                      facts.st_mode & kModeBits);
  std::string text(kMaxTokenFileBytes + 1, '\0');
  size_t size = 0;
  while (size < text.size()) {
    const ssize_t got = read(descriptor, text.data() + size, text.size() - size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return make_error(ErrorCode::BadInput, "cannot be read: {}", std::strerror(errno));
    if (got == 0) break;
    size += static_cast<size_t>(got);
  }
  if (size > kMaxTokenFileBytes)
    return make_error(ErrorCode::LimitExceeded, "the token file has more than {} bytes", kMaxTokenFileBytes);
  text.resize(size);
  return text;
}

constexpr std::string_view kExpires = "expires=";

/// Seconds since 1970 of "2027-01-31" or "2027-01-31T18:00:00Z"; nothing for other text.
std::optional<int64_t> parse_time(std::string_view text) {
  int year = 0, month = 0, day = 0, hour = 0, minute = 0, second = 0;
  const auto digits = [&](size_t at, size_t count, int& value) {
    for (size_t i = at; i < at + count; ++i) {
      if (text[i] < '0' || text[i] > '9') return false;
      value = 10 * value + (text[i] - '0');
    }
    return true;
  };
  constexpr size_t kDayChars = 10, kTimeChars = 20;
  const bool has_time = text.size() == kTimeChars;
  if (text.size() != kDayChars && !has_time) return std::nullopt;
  if (!digits(0, 4, year) || text[4] != '-' || !digits(5, 2, month) || text[7] != '-' || !digits(8, 2, day))
    return std::nullopt;
  if (has_time && (text[10] != 'T' || !digits(11, 2, hour) || text[13] != ':' || !digits(14, 2, minute) ||
                   text[16] != ':' || !digits(17, 2, second) || text[19] != 'Z'))
    return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year(year),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  if (!date.ok() || year < 1970 || hour > 23 || minute > 59 || second > 59) return std::nullopt;
  const auto days = std::chrono::sys_days(date).time_since_epoch();
  return std::chrono::duration_cast<std::chrono::seconds>(days).count() + (hour * 60 + minute) * 60 + second;
}

std::string time_text(int64_t unix_s) {
  const std::chrono::sys_seconds time{std::chrono::seconds(unix_s)};
  const auto day = std::chrono::floor<std::chrono::days>(time);
  const std::chrono::year_month_day date(day);
  const auto rest_s = (time - day).count();
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}Z", int(date.year()), unsigned(date.month()),
                     unsigned(date.day()), rest_s / 3600, rest_s / 60 % 60, rest_s % 60);
}

}  // namespace

Result<std::vector<AccessToken>> parse_tokens(const std::string& text) {
  std::vector<AccessToken> tokens;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::istringstream words(line);
    std::string first, second, third, fourth;
    words >> first >> second >> third >> fourth;
    if (first.empty() || first.starts_with('#')) continue;
    AccessToken token{second, Grant::AllButAdmin};
    if (third.starts_with(kExpires)) {
      const auto expires_s = parse_time(std::string_view(third).substr(kExpires.size()));
      if (!expires_s)
        return make_error(ErrorCode::BadInput,
                          "line {} has no time behind expires= (2027-01-31 or 2027-01-31T18:00:00Z)", number);
      token.expires_unix_s = std::max<int64_t>(*expires_s, 1);  // 0 means for ever
      third = fourth;
    }
    const auto named = std::find_if(kNamedGrants.begin(), kNamedGrants.end(),
                                    [&](Grant grant) { return first == to_string(grant); });
    if (second.empty() && named != kNamedGrants.end())
      return make_error(ErrorCode::BadInput, "line {} has the role '{}', but no token after it", number,
                        to_string(*named));
    if (second.empty()) {
      token.secret = first;
    } else if (named != kNamedGrants.end() && third.empty()) {
      token.grant = *named;
    } else {
      return make_error(
          ErrorCode::BadInput,
          "line {} is not 'role token' with a role of viewer, controller, source and admin, and "
          "expires=DATE behind it where it ends",
          number);
    }
    if (token.secret.size() > kMaxTokenBytes)
      return make_error(ErrorCode::LimitExceeded, "the token in line {} has more than {} bytes", number,
                        kMaxTokenBytes);
    if (token.secret.size() < kMinTokenCharacters)
      return make_error(ErrorCode::BadInput, "the token in line {} has {} characters, it needs at least {}",
                        number, token.secret.size(), kMinTokenCharacters);
    const bool is_twice = std::any_of(tokens.begin(), tokens.end(),
                                      [&](const AccessToken& other) { return other.secret == token.secret; });
    if (is_twice)
      return make_error(ErrorCode::BadInput, "the token in line {} stands in an earlier line too", number);
    tokens.push_back(std::move(token));
  }
  if (tokens.empty()) return make_error(ErrorCode::BadInput, "the token file is empty");
  const bool has_plain = std::any_of(tokens.begin(), tokens.end(), [](const AccessToken& token) {
    return token.grant == Grant::AllButAdmin;
  });
  if (has_plain && tokens.size() > 1)
    return make_error(ErrorCode::BadInput, "a token without a role must be the only one");
  return tokens;
}

std::string to_text(const std::vector<AccessToken>& tokens) {
  std::string text;
  for (const AccessToken& token : tokens) {
    if (token.grant == Grant::AllButAdmin) {
      text += token.secret + "\n";
      continue;
    }
    text += fmt::format("{} {}", to_string(token.grant), token.secret);
    if (token.expires_unix_s != 0) text += fmt::format(" {}{}", kExpires, time_text(token.expires_unix_s));
    text += '\n';
  }
  return text;
}

Result<TokenFile> open_token_file(const std::filesystem::path& path) {
  const auto named = [&](Error error) { return at(path.string(), std::move(error)); };
  const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.number() < 0 && errno == ENOENT) {
    auto made = make_token_file(path);
    if (!made) return named(made.error());
    return made;
  }
  if (file.number() < 0)
    return named(make_error(ErrorCode::BadInput, "cannot be opened: {}", std::strerror(errno)));
  const auto text = read_private(file.number());
  if (!text) return named(text.error());
  auto tokens = parse_tokens(*text);
  if (!tokens) return named(tokens.error());
  return TokenFile{std::move(tokens).value(), false};
}

}  // namespace strandcast
