#include "common/strands/asset/head.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/base/check.h"
#include "common/strands/asset/lattice.h"
#include "common/strands/asset/numbers.h"
#include "common/strands/byte_io.h"
#include "common/strands/wrapping.h"

namespace strandcast {
namespace asset {
namespace {

constexpr uint32_t kNone = ~0u;

/// What the walk finds behind an edge.
enum class Behind : uint32_t {
  NewVertex,    // a triangle with a vertex that was not met
  NextEdge,     // one that the next edge of the border belongs to
  EdgeBefore,   // or the edge before
  BothEdges,    // or both
  Nothing,      // the mesh ends there
  KnownVertex,  // a triangle with another vertex that was met
};
constexpr uint32_t kBehindCount = 6;

/// A directed edge of the border between triangles that were met and those that were not.
struct Edge {
  uint32_t from = 0, to = 0;
  uint32_t opposite = 0;  // the third vertex of the triangle that was met
  uint32_t before = kNone, next = kNone;
  bool is_open = true;
};

class Border {
 public:
  const Edge& operator[](uint32_t edge) const { return edges_[edge]; }
  /// Returns the open edge that came last, or kNone.
  uint32_t last_open() {
    while (!stack_.empty() && !edges_[stack_.back()].is_open) stack_.pop_back();
    return stack_.empty() ? kNone : stack_.back();
  }
  /// Goes around a triangle that hangs together with none before.
  void begin(const glm::uvec3& corner) {
    uint32_t last = kNone;
    for (int k = 0; k < 3; ++k)
      last = insert(last, kNone, {corner[k], corner[(k + 1) % 3], corner[(k + 2) % 3]});
    edges_[last - 2].before = last;
    edges_[last].next = last - 2;
  }
  const Edge& close(uint32_t edge) {
    Edge& closed = edges_[edge];
    closed.is_open = false;
    if (closed.before != kNone) edges_[closed.before].next = closed.next;
    if (closed.next != kNone) edges_[closed.next].before = closed.before;
    return closed;
  }
  /// Puts an edge between two others, where these are open.
  uint32_t insert(uint32_t before, uint32_t next, Edge edge) {
    const auto index = static_cast<uint32_t>(edges_.size());
    const auto link = [&](uint32_t other, uint32_t Edge::*of_other, uint32_t Edge::*of_edge) {
      if (other == kNone || !edges_[other].is_open) return;
      edge.*of_edge = other;
      edges_[other].*of_other = index;
    };
    link(before, &Edge::next, &Edge::before);
    link(next, &Edge::before, &Edge::next);
    if (from_.size() <= edge.from) from_.resize(edge.from + 1, kNone);
    from_[edge.from] = index;
    edges_.push_back(edge);
    stack_.push_back(index);
    return index;
  }
  /// Returns the newest edge that begins at a vertex, or kNone where that one is closed.
  uint32_t open_from(uint32_t vertex) const {
    const uint32_t edge = vertex < from_.size() ? from_[vertex] : kNone;
    return edge != kNone && edges_[edge].is_open ? edge : kNone;
  }

 private:
  std::vector<Edge> edges_;
  std::vector<uint32_t> stack_;  // of edges, open ones and others
  std::vector<uint32_t> from_;   // of each vertex the edge that was put there last
};

/// Triangles of a mesh by their directed edges.
class EdgeTable {
 public:
  EdgeTable(const std::vector<glm::uvec3>& triangles, size_t vertex_count)
      : triangles_(triangles),
        begin_(vertex_count + 1, 0),
        corner_(3 * triangles.size()),
        is_met_(triangles.size(), 0) {
    for (const glm::uvec3& triangle : triangles)
      for (int k = 0; k < 3; ++k) ++begin_[triangle[k] + 1];
    for (size_t i = 1; i < begin_.size(); ++i) begin_[i] += begin_[i - 1];
    std::vector<uint32_t> at(begin_.begin(), begin_.end() - 1);
    for (uint32_t i = 0; i < corner_.size(); ++i)
      corner_[at[triangles[i / 3][static_cast<int>(i % 3)]]++] = i;
  }
  /// Returns the first triangle that was not met, or kNone.
  uint32_t first_left() {
    while (first_ < is_met_.size() && is_met_[first_] != 0) ++first_;
    return first_ < is_met_.size() ? first_ : kNone;
  }
  /// Returns the corner 3 t + k of the first triangle t that was not met and has this edge from its corner k
  /// on.
  uint32_t find(uint32_t from, uint32_t to) const {
    for (uint32_t i = begin_[from]; i < begin_[from + 1]; ++i) {
      const uint32_t triangle = corner_[i] / 3, k = corner_[i] % 3;
      if (is_met_[triangle] == 0 && triangles_[triangle][static_cast<int>((k + 1) % 3)] == to)
        return corner_[i];
    }
    return kNone;
  }
  void meet(uint32_t triangle) { is_met_[triangle] = 1; }

 private:
  const std::vector<glm::uvec3>& triangles_;
  std::vector<uint32_t> begin_;   // (vertex_count + 1) in corner_
  std::vector<uint32_t> corner_;  // of each vertex
  std::vector<uint8_t> is_met_;
  uint32_t first_ = 0;
};

/// Octahedral code of a direction: two whole numbers within +-kOctahedron.
constexpr int32_t kOctahedron = 1 << 10;

glm::ivec2 to_octahedron(const glm::dvec3& direction) {
  const double sum = std::abs(direction.x) + std::abs(direction.y) + std::abs(direction.z);
  if (!(sum > 0.0 && std::isfinite(sum))) return {0, 0};  // upwards
  // The upper half is that of y.
  double u = direction.x / sum, v = direction.z / sum;
  if (direction.y < 0.0) {
    const double turned = (1.0 - std::abs(v)) * (u < 0.0 ? -1.0 : 1.0);
    v = (1.0 - std::abs(u)) * (v < 0.0 ? -1.0 : 1.0);
    u = turned;
  }
  return {static_cast<int32_t>(std::floor(u * kOctahedron + 0.5)),
          static_cast<int32_t>(std::floor(v * kOctahedron + 0.5))};
}

glm::vec3 from_octahedron(const glm::ivec2& code) {
  double u = static_cast<double>(code.x) / kOctahedron, v = static_cast<double>(code.y) / kOctahedron;
  const double y = 1.0 - std::abs(u) - std::abs(v);
  if (y < 0.0) {
    const double turned = (1.0 - std::abs(v)) * (u < 0.0 ? -1.0 : 1.0);
    v = (1.0 - std::abs(u)) * (v < 0.0 ? -1.0 : 1.0);
    u = turned;
  }
  return glm::vec3(glm::dvec3(u, y, v) / std::sqrt(u * u + y * y + v * v));
}

/// Twice the area of a triangle, along its normal.
glm::dvec3 area_vector(const glm::ivec3& a, const glm::ivec3& b, const glm::ivec3& c) {
  const glm::dvec3 p(b - a), q(c - a);
  return {p.y * q.z - p.z * q.y, p.z * q.x - p.x * q.z, p.x * q.y - p.y * q.x};
}

/// Where a vertex is expected, in steps, and how far from there.
struct Guess {
  glm::ivec3 point;
  glm::dvec3 normal;  // of the plane that it is expected in; 0: none
  uint32_t across = 0, along = 0;
};

/// Rounds to whole steps that no sum of two of them wraps around.
int32_t to_step(double steps) {
  return static_cast<int32_t>(std::floor(std::clamp(steps, -double{kMaxStep}, double{kMaxStep}) + 0.5));
}

/// Codes of the normals that the triangles have at their vertices, by area.
std::vector<glm::ivec2> expected_normals(const std::vector<glm::ivec3>& point,
                                         const std::vector<glm::uvec3>& triangles) {
  std::vector<glm::dvec3> sum(point.size(), glm::dvec3(0.0));
  for (const glm::uvec3& triangle : triangles) {
    const glm::dvec3 across = area_vector(point[triangle.x], point[triangle.y], point[triangle.z]);
    for (int k = 0; k < 3; ++k) sum[triangle[k]] += across;
  }
  std::vector<glm::ivec2> codes;
  for (const glm::dvec3& normal : sum) codes.push_back(to_octahedron(normal));
  return codes;
}

/// Walks over a mesh and writes it, or reads one. What is made is the mesh in the order of the walk.
template <class Coder>
class HeadWalk {
 public:
  HeadWalk(Coder& coder, const HeadCounts& counts, const std::vector<glm::uvec3>& from_triangle,
           const std::vector<glm::ivec3>& from_point)
      : coder_(coder),
        counts_(counts),
        from_triangle_(from_triangle),
        from_point_(from_point),
        table_(from_triangle, from_point.size()),
        number_(from_point.size(), kNone) {
    behind_table_.fill(even_table());
  }

  /// Returns false where what was read is no mesh of these counts.
  bool walk();
  std::vector<glm::ivec3> point;
  std::vector<glm::uvec3> triangle;
  std::vector<uint32_t> original;  // when it writes: of each vertex, its number before

 private:
  static constexpr uint32_t kAcrossKind = 0, kAlongKind = 1, kIndexKind = 2;
  static constexpr uint32_t kFarSize = 1 << 12;  // steps: between vertices that are no neighbours

  bool is_whole() const { return point.size() >= counts_.vertices; }
  uint32_t add_vertex(uint32_t before, Guess guess);
  Guess guess_behind(const Edge& edge) const;
  Guess guess_anywhere() const {
    return {point.empty() ? glm::ivec3(0) : point.back(), glm::dvec3(0.0), kFarSize, kFarSize};
  }
  uint32_t known_vertex(uint32_t before);
  void begin();
  void pass(uint32_t gate);
  Behind look_behind(const Edge& edge, uint32_t at_before, uint32_t at_next, uint32_t& third);
  Behind code_behind(Behind behind);

  Coder& coder_;
  HeadCounts counts_;
  const std::vector<glm::uvec3>& from_triangle_;
  const std::vector<glm::ivec3>& from_point_;
  EdgeTable table_;
  std::vector<uint32_t> number_;  // when it writes: of the vertices before, their new numbers
  std::vector<uint32_t> across_;  // of each vertex: how far it is from where it was expected
  std::vector<uint32_t> along_;   // and how far from the plane
  Border border_;
  std::array<SymbolTable, kBehindCount> behind_table_;  // by what was behind the edge before
  Behind last_behind_ = Behind::NewVertex;
  bool is_good_ = true;
};

/// Codes a vertex that is met for the first time: along the last axis from the plane across `normal`.
template <class Coder>
uint32_t HeadWalk<Coder>::add_vertex(uint32_t before, Guess guess) {
  const auto number = static_cast<uint32_t>(point.size());
  int last = 0;
  for (int axis = 1; axis < 3; ++axis)
    if (std::abs(guess.normal[axis]) > std::abs(guess.normal[last])) last = axis;
  glm::ivec3 at(0);
  double off_plane = 0.0;
  uint32_t seen = 0;
  for (int k = 1; k <= 3; ++k) {
    const int axis = (last + k) % 3;
    if (k == 3 && guess.normal[axis] != 0.0) guess.point[axis] -= to_step(off_plane / guess.normal[axis]);
    int32_t left = 0;
    if constexpr (!Coder::kReads) left = wrapping_difference(from_point_[before][axis], guess.point[axis]);
    coder_.code(left, k < 3 ? kAcrossKind : kAlongKind, k < 3 ? guess.across : guess.along);
    at[axis] = wrapping_sum(guess.point[axis], left);
    is_good_ &= at[axis] > -kMaxStep && at[axis] < kMaxStep;
    off_plane += guess.normal[axis] * left;
    if (k < 3) seen += magnitude(left);
    if (k == 3) along_.push_back(magnitude(left));
  }
  point.push_back(is_good_ ? at : glm::ivec3(0));
  across_.push_back(seen / 2);
  if constexpr (!Coder::kReads) {
    number_[before] = number;
    original.push_back(before);
  }
  return number;
}

/// Codes a vertex that was met before, by how long ago.
template <class Coder>
uint32_t HeadWalk<Coder>::known_vertex(uint32_t before) {
  const auto count = static_cast<uint32_t>(point.size());
  int32_t ago = 0;
  if constexpr (!Coder::kReads) ago = static_cast<int32_t>(count - 1 - number_[before]);
  coder_.code(ago, kIndexKind, count);
  is_good_ &= ago >= 0 && static_cast<uint32_t>(ago) < count;
  return is_good_ ? count - 1 - static_cast<uint32_t>(ago) : 0;
}

/// Codes a triangle that hangs together with none before.
template <class Coder>
void HeadWalk<Coder>::begin() {
  glm::uvec3 before(0), corner(0);
  if constexpr (!Coder::kReads) {
    const uint32_t first = table_.first_left();
    before = from_triangle_[first];
    table_.meet(first);
  }
  for (int k = 0; k < 3; ++k) {
    uint32_t is_new = 0;
    if constexpr (!Coder::kReads) is_new = number_[before[k]] == kNone ? 1 : 0;
    coder_.code_bits(is_new, 1);
    is_good_ &= is_new != 0 ? !is_whole() : !point.empty();
    if (!is_good_) return;
    corner[k] = is_new != 0 ? add_vertex(before[k], guess_anywhere()) : known_vertex(before[k]);
  }
  triangle.push_back(corner);
  border_.begin(corner);
}

/// When it writes: returns what is behind an edge, and the third vertex of the triangle there.
template <class Coder>
Behind HeadWalk<Coder>::look_behind(const Edge& edge, uint32_t at_before, uint32_t at_next, uint32_t& third) {
  const uint32_t corner = table_.find(original[edge.to], original[edge.from]);
  if (corner == kNone) return Behind::Nothing;
  table_.meet(corner / 3);
  third = from_triangle_[corner / 3][static_cast<int>((corner % 3 + 2) % 3)];
  const uint32_t number = number_[third];
  if (number == kNone) return Behind::NewVertex;
  if (number == at_next) return number == at_before ? Behind::BothEdges : Behind::NextEdge;
  return number == at_before ? Behind::EdgeBefore : Behind::KnownVertex;
}

template <class Coder>
Behind HeadWalk<Coder>::code_behind(Behind behind) {
  auto symbol = static_cast<uint32_t>(behind);
  coder_.code_symbol(symbol, behind_table_[static_cast<uint32_t>(last_behind_)]);
  is_good_ &= symbol < kBehindCount;
  last_behind_ = is_good_ ? static_cast<Behind>(symbol) : Behind::Nothing;
  return last_behind_;
}

/// Where the parallelogram of the triangle in front of an edge ends.
template <class Coder>
Guess HeadWalk<Coder>::guess_behind(const Edge& edge) const {
  const auto near = [&](const std::vector<uint32_t>& size) {
    return (size[edge.from] + size[edge.to] + 2 * size[edge.opposite]) / 4;
  };
  return {point[edge.from] + point[edge.to] - point[edge.opposite],
          area_vector(point[edge.from], point[edge.to], point[edge.opposite]), near(across_), near(along_)};
}

/// Codes what is behind an open edge of the border, and closes it.
template <class Coder>
void HeadWalk<Coder>::pass(uint32_t gate) {
  const Edge edge = border_[gate];
  const uint32_t at_before = edge.before != kNone ? border_[edge.before].from : kNone;
  const uint32_t at_next = edge.next != kNone ? border_[edge.next].to : kNone;
  Behind behind = Behind::Nothing;
  uint32_t from = 0;
  if constexpr (!Coder::kReads) behind = look_behind(edge, at_before, at_next, from);
  behind = code_behind(behind);
  const bool joins_before = behind == Behind::EdgeBefore || behind == Behind::BothEdges;
  const bool joins_next = behind == Behind::NextEdge || behind == Behind::BothEdges;
  is_good_ &= !(joins_before && at_before == kNone) && !(joins_next && at_next == kNone) &&
              !(behind == Behind::NewVertex && is_whole());
  border_.close(gate);
  if (!is_good_ || behind == Behind::Nothing) return;
  uint32_t third = joins_before ? at_before : at_next;
  if (behind == Behind::NewVertex)
    third = add_vertex(from, guess_behind(edge));
  else if (behind == Behind::KnownVertex)
    third = known_vertex(from);
  triangle.emplace_back(edge.to, edge.from, third);
  // A known vertex parts the border: what led to it goes on behind the new triangle.
  const uint32_t onwards = behind == Behind::KnownVertex ? border_.open_from(third) : kNone;
  const uint32_t until = onwards != kNone ? border_[onwards].before : kNone;
  uint32_t before = edge.before, next = edge.next;
  if (joins_before) before = border_.close(before).before;
  if (joins_next) next = border_.close(next).next;
  if (!joins_before)
    before = border_.insert(before, onwards != kNone ? onwards : next, {edge.from, third, edge.to});
  if (!joins_next) border_.insert(onwards != kNone ? until : before, next, {third, edge.to, edge.from});
}

template <class Coder>
bool HeadWalk<Coder>::walk() {
  while (is_good_ && !coder_.is_short()) {
    if (const uint32_t gate = border_.last_open(); gate != kNone)
      pass(gate);
    else if (triangle.size() < counts_.triangles)
      begin();
    else
      break;
    is_good_ &= triangle.size() <= counts_.triangles;
  }
  uint32_t before = 0;  // vertices of no triangle follow
  while (is_good_ && !coder_.is_short() && !is_whole()) {
    if constexpr (!Coder::kReads)
      while (number_[before] != kNone) ++before;
    add_vertex(before, guess_anywhere());
  }
  return is_good_;
}

template <class Coder>
void code_normals(Coder& coder, const std::vector<glm::ivec2>& expected, std::vector<glm::ivec2>& code) {
  constexpr uint32_t kNormalKind = 3;
  uint32_t size = 0;
  for (size_t i = 0; i < expected.size(); ++i)
    for (int axis = 0; axis < 2; ++axis) {
      int32_t left = 0;
      if constexpr (!Coder::kReads) left = code[i][axis] - expected[i][axis];
      coder.code(left, kNormalKind, size / 4);
      if constexpr (Coder::kReads) code[i][axis] = wrapping_sum(expected[i][axis], left);
      size = size - size / 4 + magnitude(left);
    }
}

bool is_same(const Mesh& a, const Mesh& b) {
  const auto is_bytewise = [](const auto& x, const auto& y) {
    return x.size() == y.size() && std::memcmp(x.data(), y.data(), x.size() * sizeof x[0]) == 0;
  };
  return is_bytewise(a.position_m, b.position_m) && is_bytewise(a.normal, b.normal) &&
         is_bytewise(a.triangle, b.triangle);
}

/// Writes a mesh whose positions are on a lattice, and returns it as it will be read.
Mesh write_head(const Mesh& mesh, const LatticePoints& points, NumberWriter& numbers) {
  HeadWalk<NumberWriter> head(
      numbers, {static_cast<uint32_t>(points.point.size()), static_cast<uint32_t>(mesh.triangle.size())},
      mesh.triangle, points.point);
  CHECK(head.walk());
  std::vector<glm::ivec2> code;
  // Twice: of two codes for the same direction the second is always the same.
  for (const uint32_t before : head.original)
    code.push_back(
        to_octahedron(glm::dvec3(from_octahedron(to_octahedron(glm::dvec3(mesh.normal[before]))))));
  code_normals(numbers, expected_normals(head.point, head.triangle), code);
  Mesh sent{to_metres({points.step_bits, head.point}), {}, head.triangle};
  for (const glm::ivec2& one : code) sent.normal.push_back(from_octahedron(one));
  return sent;
}

}  // namespace

bool append_head(const Mesh& mesh, std::vector<std::byte>& destination) {
  const auto points = to_lattice(mesh.position_m);
  if (!points) return false;
  NumberWriter numbers;
  if (!is_same(write_head(mesh, *points, numbers), mesh)) return false;
  ByteWriter(destination).put(static_cast<uint8_t>(points->step_bits));
  numbers.finish(destination);
  return true;
}

Status read_head(std::span<const std::byte> source, const HeadCounts& counts, Mesh& mesh) {
  ByteReader reader(source);
  const uint32_t step_bits = reader.take<uint8_t>();
  if (!reader.ok() || step_bits > kMaxStepBits)
    return make_error(ErrorCode::BadInput, "the asset's head has steps of 2^-{} m, allowed are at most {}",
                      step_bits, kMaxStepBits);
  ValueReader values;
  ASSIGN_OR_RETURN(const auto rest, values.open(reader.rest()));
  NumberReader numbers(values);
  const Mesh nothing;
  const LatticePoints no_points;
  HeadWalk<NumberReader> head(numbers, counts, nothing.triangle, no_points.point);
  const bool is_mesh = head.walk();
  std::vector<glm::ivec2> code(head.point.size());
  if (is_mesh) code_normals(numbers, expected_normals(head.point, head.triangle), code);
  if (!is_mesh || !values.is_spent() || !rest.empty())
    return make_error(ErrorCode::BadInput,
                      "the bytes of the asset's head are none of a mesh of {} vertices and {} triangles",
                      counts.vertices, counts.triangles);
  for (const glm::ivec2& one : code)
    if (std::abs(one.x) > kOctahedron || std::abs(one.y) > kOctahedron)
      return make_error(ErrorCode::BadInput, "a normal of the asset's head is none");
  mesh.position_m = to_metres({step_bits, head.point});
  mesh.normal.clear();
  for (const glm::ivec2& one : code) mesh.normal.push_back(from_octahedron(one));
  mesh.triangle = std::move(head.triangle);
  return {};
}

}  // namespace asset

Mesh as_sent(const Mesh& mesh) {
  const auto is_near = [](const glm::vec3& point) {
    return std::abs(point.x) <= kMaxMeshExtentM && std::abs(point.y) <= kMaxMeshExtentM &&
           std::abs(point.z) <= kMaxMeshExtentM;
  };
  if (mesh.triangle.empty() || !std::all_of(mesh.position_m.begin(), mesh.position_m.end(), is_near))
    return mesh;
  asset::LatticePoints points{kHeadStepBits, {}};
  for (const glm::vec3& position : mesh.position_m)
    points.point.emplace_back(glm::dvec3(asset::rounded(position, kHeadStepBits)) *
                              std::ldexp(1.0, kHeadStepBits));
  asset::NumberWriter numbers;
  Mesh sent = asset::write_head(mesh, points, numbers);
  sent.form = mesh.form;
  return sent;
}

}  // namespace strandcast
