#include "common/groom/groom_source.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "common/base/check.h"

namespace strandcast {

static_assert(std::endian::native == std::endian::little, "groom files are little-endian and read in place");

Result<std::shared_ptr<GroomSource>> GroomSource::open(const std::filesystem::path& path) {
  struct stat info {};
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (file < 0) return make_error(ErrorCode::NotFound, "no such file or no permission to read it");
  const bool is_known = ::fstat(file, &info) == 0;
  std::shared_ptr<GroomSource> source(
      new GroomSource(file, is_known ? static_cast<uint64_t>(info.st_size) : 0));
  if (!is_known || !S_ISREG(info.st_mode)) return make_error(ErrorCode::BadInput, "not a regular file");
  return source;
}

GroomSource::~GroomSource() {
  if (file_ >= 0) ::close(file_);
}

void GroomSource::narrow(uint64_t offset, uint64_t size_bytes) {
  CHECK(has(offset, size_bytes, 1));
  begin_ += offset;
  size_bytes_ = size_bytes;
}

Status GroomSource::claim(uint64_t size_bytes) {
  const uint64_t cost = std::max(size_bytes, kLeastGroomReadBytes);
  if (cost > left_bytes_)
    return make_error(ErrorCode::LimitExceeded, "more than {} bytes of it would have to be read",
                      kMaxGroomReadBytes);
  left_bytes_ -= cost;
  return {};
}

Status GroomSource::check_reaches(uint64_t contents) const {
  if (contents < size_bytes_) return {};
  return make_error(
      ErrorCode::BadInput,
      "it is cut off at byte {}, before the list of what is in it, which stands at the end: nothing "
      "of it can be had; copy it again, or export it anew (as .usda, which is read up to a cut)",
      size_bytes_);
}

Status GroomSource::check(uint64_t offset, uint64_t count, uint64_t item_bytes) {
  if (!has(offset, count, item_bytes))
    return make_error(ErrorCode::BadInput, "it ends at byte {}, within what is needed", size_bytes_);
  return claim(count * item_bytes);
}

Status GroomSource::read(uint64_t offset, std::span<std::byte> to) const {
  offset += begin_;
  if (to.empty()) return {};
  if (file_ < 0) {
    std::memcpy(to.data(), memory_.data() + offset, to.size());
    return {};
  }
  while (!to.empty()) {
    const ssize_t count = ::pread(file_, to.data(), to.size(), static_cast<off_t>(offset));
    if (count <= 0) return make_error(ErrorCode::BadInput, "cannot read {} bytes", to.size());
    offset += static_cast<uint64_t>(count);
    to = to.subspan(static_cast<size_t>(count));
  }
  return {};
}

}  // namespace strandcast
