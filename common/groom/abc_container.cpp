#include "common/groom/abc_container.h"

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

Result<AbcContainer> AbcContainer::open(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(auto source, GroomSource::open(path));
  return begin(std::move(source));
}

Result<AbcContainer> AbcContainer::of(std::span<const std::byte> file) {
  return begin(std::make_shared<GroomSource>(file));
}

Result<AbcContainer> AbcContainer::begin(std::shared_ptr<GroomSource> source) {
  const size_t known = std::min(source->size_bytes(), kAbcHeaderBytes);
  ASSIGN_OR_RETURN(const std::vector<char> header, source->array<char>(0, known));
  const std::string_view text(header.data(), known);
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
  std::memcpy(&container.root_, header.data() + kRootAt, sizeof(container.root_));
  RETURN_IF_ERROR(container.source_->check_reaches(container.root_));
  return container;
}

Result<AbcGroup> AbcContainer::group(AbcChild child) const {
  if ((child & kBlockBit) != 0)
    return make_error(ErrorCode::BadInput, "a block of bytes lies at byte {} where a group belongs",
                      child & ~kBlockBit);
  if (child == 0) return AbcGroup{};
  if (child < kAbcHeaderBytes || !source_->has(child, 1, sizeof(uint64_t)))
    return make_error(ErrorCode::BadInput, "a group should lie at byte {} of {}: it is cut off or damaged",
                      child, source_->size_bytes());
  ASSIGN_OR_RETURN(const uint64_t count, source_->number<uint64_t>(child));
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
  ASSIGN_OR_RETURN(const uint64_t size_bytes, source_->number<uint64_t>(offset));
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
  return source_->number<AbcChild>(group.offset + index * sizeof(AbcChild));
}

Result<std::vector<AbcChild>> AbcContainer::children(const AbcGroup& group, uint64_t limit) const {
  if (group.count > limit)
    return make_error(ErrorCode::LimitExceeded,
                      "the group at byte {} has {} children, at most {} are allowed", group.offset,
                      group.count, limit);
  return source_->array<AbcChild>(group.offset, group.count);
}

Result<std::vector<std::byte>> AbcContainer::read(const AbcBlock& block, uint64_t limit_bytes) const {
  if (block.size_bytes > limit_bytes)
    return make_error(ErrorCode::LimitExceeded, "the block at byte {} has {} bytes, at most {} are allowed",
                      block.offset, block.size_bytes, limit_bytes);
  return source_->array<std::byte>(block.offset, block.size_bytes);
}

}  // namespace strandcast
