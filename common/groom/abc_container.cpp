#include "common/groom/abc_container.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <string_view>

namespace strandcast {
namespace {

constexpr uint64_t kAbcHeaderBytes = 16;
constexpr std::string_view kOgawa = "Ogawa", kHdf5 = "\x89HDF";
constexpr size_t kFinishedAt = 5, kVersionAt = 6, kRootAt = 8;
constexpr AbcChild kBlockBit = AbcChild{1} << 63;

}  // namespace

/// Bytes in memory or of an open file, and how many of them may still be read.
class AbcContainer::Source {
 public:
  explicit Source(std::span<const std::byte> memory) : memory_(memory), size_bytes_(memory.size()) {}
  Source(int file, uint64_t size_bytes) : file_(file), size_bytes_(size_bytes) {}
  ~Source() {
    if (file_ >= 0) ::close(file_);
  }
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;

  bool has(uint64_t offset, uint64_t count, uint64_t item_bytes) const {
    return offset <= size_bytes_ && count <= (size_bytes_ - offset) / item_bytes;
  }
  uint64_t size_bytes() const { return size_bytes_; }

  /// Checks that `size_bytes` are there and may still be read, and counts them.
  Status claim(uint64_t offset, uint64_t size_bytes) {
    const uint64_t cost = std::max(size_bytes, kLeastAbcReadBytes);
    if (!has(offset, size_bytes, 1))
      return make_error(ErrorCode::BadInput, "it ends at byte {}, within what is needed", size_bytes_);
    if (cost > left_bytes_)
      return make_error(ErrorCode::LimitExceeded, "more than {} bytes of it would have to be read",
                        kMaxAbcReadBytes);
    left_bytes_ -= cost;
    return {};
  }

  /// Reads what was claimed.
  Status read(uint64_t offset, std::span<std::byte> to) const {
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

 private:
  const std::span<const std::byte> memory_;
  const int file_ = -1;
  const uint64_t size_bytes_;
  uint64_t left_bytes_ = kMaxAbcReadBytes;
};

Result<AbcContainer> AbcContainer::open(const std::filesystem::path& path) {
  struct stat info {};
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (file < 0) return make_error(ErrorCode::NotFound, "no such file or no permission to read it");
  const bool is_known = ::fstat(file, &info) == 0;
  const auto source = std::make_shared<Source>(file, is_known ? static_cast<uint64_t>(info.st_size) : 0);
  if (!is_known || !S_ISREG(info.st_mode)) return make_error(ErrorCode::BadInput, "not a regular file");
  return begin(source);
}

Result<AbcContainer> AbcContainer::of(std::span<const std::byte> file) {
  return begin(std::make_shared<Source>(file));
}

Result<AbcContainer> AbcContainer::begin(std::shared_ptr<Source> source) {
  char header[kAbcHeaderBytes] = {};
  const size_t known = std::min(source->size_bytes(), kAbcHeaderBytes);
  RETURN_IF_ERROR(source->claim(0, known));
  RETURN_IF_ERROR(source->read(0, std::as_writable_bytes(std::span(header).first(known))));
  const std::string_view text(header, known);
  if (text.starts_with(kHdf5))
    return make_error(ErrorCode::Unsupported,
                      "this is Alembic in its old container, HDF5: export it anew as Ogawa");
  if (!text.starts_with(kOgawa))
    return make_error(ErrorCode::BadInput, "does not begin with 'Ogawa': not an Alembic file");
  if (known < kAbcHeaderBytes)
    return make_error(ErrorCode::BadInput, "{} bytes, an Alembic header alone has {}", known,
                      kAbcHeaderBytes);
  if (text[kFinishedAt] != '\xff')
    return make_error(ErrorCode::BadInput, "its writer did not finish it: export it anew");
  const int version =
      256 * static_cast<uint8_t>(text[kVersionAt]) + static_cast<uint8_t>(text[kVersionAt + 1]);
  if (version != 1)
    return make_error(ErrorCode::Unsupported, "Ogawa version {}, known is version 1", version);
  AbcContainer container(std::move(source));
  std::memcpy(&container.root_, header + kRootAt, sizeof(container.root_));
  return container;
}

Result<uint64_t> AbcContainer::number_at(uint64_t offset) const {
  uint64_t number = 0;
  RETURN_IF_ERROR(source_->claim(offset, sizeof(number)));
  RETURN_IF_ERROR(source_->read(offset, std::as_writable_bytes(std::span(&number, 1))));
  return number;
}

Result<AbcGroup> AbcContainer::group(AbcChild child) const {
  if ((child & kBlockBit) != 0)
    return make_error(ErrorCode::BadInput, "a block of bytes lies at byte {} where a group belongs",
                      child & ~kBlockBit);
  if (child == 0) return AbcGroup{};
  if (child < kAbcHeaderBytes || !source_->has(child, 1, sizeof(uint64_t)))
    return make_error(ErrorCode::BadInput, "a group should lie at byte {} of {}: it is cut off or damaged",
                      child, source_->size_bytes());
  ASSIGN_OR_RETURN(const uint64_t count, number_at(child));
  const AbcGroup group{child + sizeof(uint64_t), count};
  if (count == 0 || !source_->has(group.offset, count, sizeof(AbcChild)))
    return make_error(ErrorCode::BadInput, "the group at byte {} of {} says that it has {} children", child,
                      source_->size_bytes(), count);
  return group;
}

Result<AbcBlock> AbcContainer::block(AbcChild child) const {
  const uint64_t offset = child & ~kBlockBit;
  if ((child & kBlockBit) == 0)
    return make_error(ErrorCode::BadInput, "a group lies at byte {} where a block of bytes belongs", offset);
  if (offset == 0) return AbcBlock{};
  if (offset < kAbcHeaderBytes || !source_->has(offset, 1, sizeof(uint64_t)))
    return make_error(ErrorCode::BadInput, "a block should lie at byte {} of {}: it is cut off or damaged",
                      offset, source_->size_bytes());
  ASSIGN_OR_RETURN(const uint64_t size_bytes, number_at(offset));
  const AbcBlock block{offset + sizeof(uint64_t), size_bytes};
  if (!source_->has(block.offset, size_bytes, 1))
    return make_error(ErrorCode::BadInput, "the block at byte {} of {} says that it has {} bytes", offset,
                      source_->size_bytes(), size_bytes);
  return block;
}

Result<AbcChild> AbcContainer::child(const AbcGroup& group, uint64_t index) const {
  if (index >= group.count)
    return make_error(ErrorCode::BadInput, "the group at byte {} has {} children, number {} is needed",
                      group.offset, group.count, index);
  return number_at(group.offset + index * sizeof(AbcChild));
}

Result<std::vector<AbcChild>> AbcContainer::children(const AbcGroup& group, uint64_t limit) const {
  if (group.count > limit)
    return make_error(ErrorCode::LimitExceeded,
                      "the group at byte {} has {} children, at most {} are allowed", group.offset,
                      group.count, limit);
  RETURN_IF_ERROR(source_->claim(group.offset, group.count * sizeof(AbcChild)));
  std::vector<AbcChild> children(group.count);
  RETURN_IF_ERROR(source_->read(group.offset, std::as_writable_bytes(std::span(children))));
  return children;
}

Result<std::vector<std::byte>> AbcContainer::read(const AbcBlock& block, uint64_t limit_bytes) const {
  if (block.size_bytes > limit_bytes)
    return make_error(ErrorCode::LimitExceeded, "the block at byte {} has {} bytes, at most {} are allowed",
                      block.offset, block.size_bytes, limit_bytes);
  RETURN_IF_ERROR(source_->claim(block.offset, block.size_bytes));
  std::vector<std::byte> bytes(block.size_bytes);
  RETURN_IF_ERROR(source_->read(block.offset, bytes));
  return bytes;
}

}  // namespace strandcast
