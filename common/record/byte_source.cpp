#include "common/record/byte_source.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace strandcast {
namespace {

Error past_end(uint64_t offset, size_t bytes, uint64_t size) {
  return make_error(ErrorCode::BadInput, "{} bytes are missing at {}: it ends at {}", bytes, offset, size);
}

class FileSource : public ByteSource {
 public:
  FileSource(int file, uint64_t size_bytes) : file_(file), size_bytes_(size_bytes) {}
  ~FileSource() override { ::close(file_); }
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;

  uint64_t size_bytes() const override { return size_bytes_; }
  Status read(uint64_t offset, std::span<std::byte> destination) override {
    if (offset > size_bytes_ || destination.size() > size_bytes_ - offset)
      return past_end(offset, destination.size(), size_bytes_);
    while (!destination.empty()) {
      const ssize_t got = ::pread(file_, destination.data(), destination.size(), static_cast<off_t>(offset));
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) return make_error(ErrorCode::Unavailable, "cannot be read: {}", std::strerror(errno));
      if (got == 0) return past_end(offset, destination.size(), offset);  // shorter than it was
      destination = destination.subspan(static_cast<size_t>(got));
      offset += static_cast<uint64_t>(got);
    }
    return {};
  }

 private:
  const int file_;
  const uint64_t size_bytes_;
};

class MemorySource : public ByteSource {
 public:
  explicit MemorySource(std::vector<std::byte> bytes) : bytes_(std::move(bytes)) {}

  uint64_t size_bytes() const override { return bytes_.size(); }
  Status read(uint64_t offset, std::span<std::byte> destination) override {
    if (offset > bytes_.size() || destination.size() > bytes_.size() - offset)
      return past_end(offset, destination.size(), bytes_.size());
    if (!destination.empty()) std::memcpy(destination.data(), bytes_.data() + offset, destination.size());
    return {};
  }

 private:
  const std::vector<std::byte> bytes_;
};

}  // namespace

Result<std::unique_ptr<ByteSource>> open_byte_source(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);  // a pipe opens, and is refused
  if (file < 0)
    return at(path.string(), make_error(ErrorCode::NotFound, "cannot be opened: {}", std::strerror(errno)));
  struct stat info {};
  if (::fstat(file, &info) != 0 || !S_ISREG(info.st_mode)) {
    ::close(file);
    return at(path.string(), make_error(ErrorCode::BadInput, "not a regular file"));
  }
  return std::unique_ptr<ByteSource>(std::make_unique<FileSource>(file, static_cast<uint64_t>(info.st_size)));
}

std::unique_ptr<ByteSource> memory_byte_source(std::vector<std::byte> bytes) {
  return std::make_unique<MemorySource>(std::move(bytes));
}

}  // namespace strandcast
