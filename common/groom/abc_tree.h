// AbcTree: the objects of an Alembic file with their transforms, instances put in place. Walked without
// recursion. Untrusted input. Private to the loader; one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/groom/abc_archive.h"

namespace strandcast {

inline constexpr uint64_t kMaxAbcDepth = 2'000;     // objects in each other
inline constexpr uint64_t kMaxAbcXformOps = 1'000;  // of one transform

enum class AbcKind : uint8_t { Xform, Curves, Other };

struct AbcXform {
  bool is_inheriting = true;
  std::vector<uint8_t> ops;             // type and hint of each
  std::optional<AbcProperty> channels;  // their numbers; empty: there are none
};

struct AbcNode {
  std::optional<size_t> parent;
  AbcObject object;
  AbcKind kind = AbcKind::Other;
  uint64_t depth = 0;
  bool is_visible = true;
  bool is_instance = false;  // it stands for the object that `object` names
  std::optional<AbcXform> xform;
  std::optional<glm::dmat4> world_from_node;  // where it does not move
};

class AbcTree {
 public:
  /// Reads all objects, parents before what is in them. LimitExceeded for too many or too deep ones, which
  /// loops are.
  static Result<AbcTree> read(const AbcArchive& archive);

  const std::vector<AbcNode>& nodes() const { return nodes_; }
  /// Returns the number of instances whose source is not in the file.
  size_t lost_instance_count() const { return lost_instance_count_; }
  /// Returns the path of an object, "/groom/strands", in a form for messages.
  std::string path(size_t node) const;
  /// Computes the transform from an object's points to the file's space at a time.
  Result<glm::dmat4> world_from_node(const AbcArchive& archive, size_t node, double time_s) const;

 private:
  Status add(const AbcArchive& archive, AbcNode node);

  std::vector<AbcNode> nodes_;
  std::map<std::string, std::optional<AbcObject>> sources_;  // of instances, by their paths
  size_t lost_instance_count_ = 0;
};

/// Computes a transform's own matrix. BadInput for an unknown operation or too few numbers.
Result<glm::dmat4> abc_matrix(const AbcArchive& archive, const AbcXform& xform, uint64_t sample);

}  // namespace strandcast
