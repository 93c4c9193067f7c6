// AbcContainer: groups and blocks of bytes in an Alembic file (Ogawa), read by offset and never as a whole.
// Untrusted input: every offset and size is checked, and all reads together have a limit. Private to the
// loader; one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/groom/groom_source.h"

namespace strandcast {

/// Entry of a group: an offset in the file; the top bit says that a block of data lies there, not a group.
using AbcChild = uint64_t;

struct AbcGroup {
  uint64_t offset = 0;  // of its first child
  uint64_t count = 0;
};

struct AbcBlock {
  uint64_t offset = 0;
  uint64_t size_bytes = 0;
};

class AbcContainer {
 public:
  /// Opens a file of any size. NotFound, or BadInput for what is no finished Ogawa file.
  static Result<AbcContainer> open(const std::filesystem::path& path);
  /// Reads from memory, which must outlive the container.
  static Result<AbcContainer> of(std::span<const std::byte> file);

  AbcChild root() const { return root_; }
  /// Finds a group or a block. BadInput if the child is of the other kind or lies outside of the file.
  Result<AbcGroup> group(AbcChild child) const;
  Result<AbcBlock> block(AbcChild child) const;
  /// Reads one child of a group. BadInput if the group has fewer.
  Result<AbcChild> child(const AbcGroup& group, uint64_t index) const;
  /// Reads all children of a group; LimitExceeded if it has more than `limit`.
  Result<std::vector<AbcChild>> children(const AbcGroup& group, uint64_t limit) const;
  /// Reads a block; LimitExceeded if it is longer than `limit_bytes`.
  Result<std::vector<std::byte>> read(const AbcBlock& block, uint64_t limit_bytes) const;

 private:
  explicit AbcContainer(std::shared_ptr<GroomSource> source) : source_(std::move(source)) {}
  static Result<AbcContainer> begin(std::shared_ptr<GroomSource> source);

  std::shared_ptr<GroomSource> source_;
  AbcChild root_ = 0;
};

}  // namespace strandcast
