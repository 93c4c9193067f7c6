// GroomSource: bytes in memory or of an open file, read by offset and never as a whole. Untrusted input:
// every read is checked before anything is allocated, and all reads together have a limit. Private to the
// loaders; one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/groom/groom.h"

namespace strandcast {

/// Bytes that one load may read, however large the file is. Each read counts as kLeastGroomReadBytes or more.
inline constexpr uint64_t kMaxGroomReadBytes = kMaxGroomFileBytes;
inline constexpr uint64_t kLeastGroomReadBytes = 128;

class GroomSource {
 public:
  /// Opens a regular file of any size. NotFound or BadInput.
  static Result<std::shared_ptr<GroomSource>> open(const std::filesystem::path& path);
  /// Reads from memory, which must outlive the source.
  explicit GroomSource(std::span<const std::byte> memory) : memory_(memory), size_bytes_(memory.size()) {}
  ~GroomSource();
  GroomSource(const GroomSource&) = delete;
  GroomSource& operator=(const GroomSource&) = delete;

  uint64_t size_bytes() const { return size_bytes_; }
  /// Returns whether `count` items of `item_bytes`, starting at `offset`, lie inside.
  bool has(uint64_t offset, uint64_t count, uint64_t item_bytes) const {
    return offset <= size_bytes_ && count <= (size_bytes_ - offset) / item_bytes;
  }
  /// BadInput where the bytes end before the list of what they hold, which begins at `contents`.
  Status check_reaches(uint64_t contents) const;
  /// Leaves nothing but a part, which has to lie inside; its first byte is byte 0 from now on.
  void narrow(uint64_t offset, uint64_t size_bytes);
  /// Counts bytes that are to be read or unpacked. LimitExceeded if that is too many.
  Status claim(uint64_t size_bytes);

  /// Reads `count` items that begin at `offset`. BadInput if they are not all there, or LimitExceeded.
  template <class T>
  Result<std::vector<T>> array(uint64_t offset, uint64_t count) {
    RETURN_IF_ERROR(check(offset, count, sizeof(T)));
    std::vector<T> items(count);
    RETURN_IF_ERROR(read(offset, std::as_writable_bytes(std::span(items))));
    return items;
  }
  template <class T>
  Result<T> number(uint64_t offset) {
    RETURN_IF_ERROR(check(offset, 1, sizeof(T)));
    T value{};
    RETURN_IF_ERROR(read(offset, std::as_writable_bytes(std::span(&value, 1))));
    return value;
  }

 private:
  GroomSource(int file, uint64_t size_bytes) : file_(file), size_bytes_(size_bytes) {}
  Status check(uint64_t offset, uint64_t count, uint64_t item_bytes);
  Status read(uint64_t offset, std::span<std::byte> to) const;

  const std::span<const std::byte> memory_;
  const int file_ = -1;
  uint64_t begin_ = 0;  // of the part
  uint64_t size_bytes_;
  uint64_t left_bytes_ = kMaxGroomReadBytes;
};

}  // namespace strandcast
