#include <sys/stat.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include "common/base/check.h"
#include "common/base/file.h"
#include "common/base/hash.h"
#include "common/base/profile.h"
#include "common/base/quantile.h"
#include "common/base/result.h"

namespace strandcast {

Error::Error() = default;
Error::Error(ErrorCode kind, std::string sentence, std::string where)
    : code(kind), message(std::move(sentence)), place(std::move(where)) {}
Error::Error(const Error&) = default;
Error::Error(Error&&) noexcept = default;
Error& Error::operator=(const Error&) = default;
Error& Error::operator=(Error&&) noexcept = default;
Error::~Error() = default;

std::string Error::to_string() const {
  return place.empty() ? message : place + ": " + message;
}

Error at(std::string place, Error error) {
  error.place = error.place.empty() ? std::move(place) : place + ", " + error.place;
  return error;
}

const char* to_string(ErrorCode code) {
  switch (code) {
    case ErrorCode::BadInput:
      return "bad input";
    case ErrorCode::NotFound:
      return "not found";
    case ErrorCode::LimitExceeded:
      return "limit exceeded";
    case ErrorCode::Unsupported:
      return "unsupported";
    case ErrorCode::Unavailable:
      return "unavailable";
    case ErrorCode::Unauthorized:
      return "unauthorized";
    case ErrorCode::Timeout:
      return "timeout";
    case ErrorCode::Internal:
      return "internal error";
  }
  return "unknown";
}

void check_failed(const char* condition, const char* file, int line) {
  std::fputs(fmt::format("{}:{}: broken invariant: {}\n", file, line, condition).c_str(), stderr);
  std::abort();
}

uint64_t hash_bytes(std::span<const std::byte> bytes, uint64_t seed) {
  constexpr uint64_t kPrime = 0x100000001b3ull;
  uint64_t hash = seed;
  size_t offset = 0;
  for (; offset + 8 <= bytes.size(); offset += 8) {
    uint64_t word;
    std::memcpy(&word, bytes.data() + offset, 8);
    hash = hash_word(word, hash);
  }
  for (; offset < bytes.size(); ++offset) hash = (hash ^ static_cast<uint64_t>(bytes[offset])) * kPrime;
  return hash;
}

Result<std::vector<std::byte>> load_file(const std::filesystem::path& path, uint64_t limit_bytes) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0)
    return at(path.string(), make_error(ErrorCode::NotFound, "no such file or no permission to read it"));
  if (!S_ISREG(info.st_mode)) return at(path.string(), make_error(ErrorCode::BadInput, "not a regular file"));
  const auto size_bytes = static_cast<uint64_t>(info.st_size);
  if (size_bytes > limit_bytes)
    return at(path.string(), make_error(ErrorCode::LimitExceeded, "file has {} bytes, the limit is {}",
                                        size_bytes, limit_bytes));
  std::ifstream stream(path, std::ios::binary);
  std::vector<std::byte> bytes(size_bytes);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size_bytes));
  if (!stream) return at(path.string(), make_error(ErrorCode::BadInput, "cannot read {} bytes", size_bytes));
  return bytes;
}

Result<std::string> load_text(const std::filesystem::path& path, uint64_t limit_bytes) {
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  ASSIGN_OR_RETURN(const auto bytes, load_file(path, limit_bytes));
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  return std::string(text);
}

Status save_file(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  const std::filesystem::path temporary = path.string() + ".part";
  {
    std::ofstream stream(temporary, std::ios::binary | std::ios::trunc);
    stream.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    stream.flush();
    if (!stream) return at(path.string(), make_error(ErrorCode::Unavailable, "cannot write the file"));
  }
  std::error_code failure;
  std::filesystem::rename(temporary, path, failure);
  if (failure)
    return at(path.string(),
              make_error(ErrorCode::Unavailable, "cannot write the file ({})", failure.message()));
  return {};
}

void StageTimer::add_ms(double value_ms) {
  if (window_ms_.size() < kStageWindow)
    window_ms_.push_back(value_ms);
  else
    window_ms_[count_ % kStageWindow] = value_ms;
  ++count_;
}

double StageTimer::quantile_ms(double quantile) const {
  return strandcast::quantile(window_ms_, quantile);
}

}  // namespace strandcast
