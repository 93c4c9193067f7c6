// PointTree: nearest neighbours of points in space. A balanced k-d tree, so that clustered or coincident
// points (which a file may hold) cost no more than even ones. Built once, then read from any thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace strandcast {

class PointTree {
 public:
  /// Builds the tree; `points` must outlive it.
  explicit PointTree(std::span<const glm::vec3> points);

  struct Neighbour {
    float distance_squared = 0.0f;
    uint32_t index = 0;
    bool operator<(const Neighbour& other) const {
      return distance_squared != other.distance_squared ? distance_squared < other.distance_squared
                                                        : index < other.index;
    }
  };

  /// Returns the `count` points nearest to `center`, nearest first; fewer if the tree holds fewer.
  std::vector<Neighbour> nearest(const glm::vec3& center, uint32_t count) const;

 private:
  void build(uint32_t begin, uint32_t end);
  struct Search;
  void visit(uint32_t begin, uint32_t end, Search& search) const;

  std::span<const glm::vec3> points_;
  std::vector<uint32_t> order_;      // the median of each range is its node
  std::vector<uint8_t> split_axis_;  // by position in order_, of the range with this median
  glm::vec3 low_m_, high_m_;         // of all points
};

}  // namespace strandcast
