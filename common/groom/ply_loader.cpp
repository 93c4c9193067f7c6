#include "common/groom/ply_loader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "common/base/file.h"
#include "common/base/hash.h"
#include "common/base/mercy.h"
#include "common/base/quantile.h"
#include "common/groom/ply_table.h"
#include "common/groom/text_scan.h"
#include "common/groom/usable_strands.h"

namespace strandcast {
namespace {

constexpr uint32_t kNoVertex = ~0u;

/// What the rows of a file hold.
struct PlyRowsRead {
  std::vector<glm::vec3> points;
  std::vector<std::vector<uint32_t>> strand_vertices;  // of lists
  std::vector<uint32_t> strand_counts;                 // vertices of each
  std::vector<std::pair<uint32_t, uint32_t>> edges;
  uint64_t face_count = 0;
  std::vector<std::string> notes;
};

/// Calls `take` for every row. Where the file ends before a tenth of the rows at most, that is noted.
template <class Take>
Status take_rows(PlyRows& rows, const PlyElement& element, std::vector<std::string>& notes, Take take) {
  for (uint64_t row = 0; row < element.row_count; ++row) {
    if (const Status is_there = rows.read(element, row); !is_there) {
      if (!rows.has_ended()) return is_there;
      BadItems missing;
      missing.add(is_there.error(), element.row_count - row);
      return missing.settle(element.row_count, "rows", "since the file is cut off", notes);
    }
    RETURN_IF_ERROR(take(row));
  }
  return {};
}

bool is_strand_element(const std::string& name) {
  return name == "strand" || name == "strands" || name == "curve" || name == "curves" || name == "polyline";
}

Status read_points(PlyRows& rows, const PlyElement& element, PlyRowsRead& read) {
  std::array<size_t, 3> axis{};
  for (size_t i = 0; i < axis.size(); ++i) {
    const std::string_view name = std::array{"x", "y", "z"}[i];
    const auto found = element.find({name}, false);
    if (!found) return make_error(ErrorCode::BadInput, "element 'vertex' has no property '{}'", name);
    axis[i] = *found;
  }
  if (element.row_count > kMaxGroomVertices)
    return make_error(ErrorCode::LimitExceeded, "{} points, at most {} are allowed", element.row_count,
                      kMaxGroomVertices);
  RETURN_IF_ERROR(take_rows(rows, element, read.notes, [&](uint64_t) -> Status {
    glm::vec3 point;
    for (int i = 0; i < 3; ++i) point[i] = static_cast<float>(rows.value(axis[static_cast<size_t>(i)]));
    read.points.push_back(point);
    return {};
  }));
  // Strands that a cut file does not have to their end are left out as those with a broken point are.
  read.points.resize(element.row_count, glm::vec3(std::numeric_limits<float>::quiet_NaN()));
  return {};
}

Result<uint32_t> vertex_index(double value, const char* what, uint64_t row) {
  if (value >= 0.0 && value < static_cast<double>(kMaxGroomVertices)) return static_cast<uint32_t>(value);
  return make_error(ErrorCode::BadInput, "{} {} names vertex {}", what, row, value);
}

Status read_strands(PlyRows& rows, const PlyElement& element, PlyRowsRead& read) {
  const auto list = element.find({"vertex_indices", "vertex_index", "vertices", "indices"}, true);
  const auto segments = element.find({"nsegs", "segments", "num_segments", "segment_count"}, false);
  const auto vertices =
      element.find({"nverts", "vertices", "num_vertices", "vertex_count", "count", "npoints"}, false);
  if (!list && !segments && !vertices)
    return make_error(ErrorCode::BadInput,
                      "element {} has neither a list 'vertex_indices' nor a number 'nsegs' or 'nverts'",
                      strandcast::quoted(element.name));
  if (element.row_count > kMaxStrandCount)
    return make_error(ErrorCode::LimitExceeded, "{} strands, at most {} are allowed: export fewer of them",
                      element.row_count, kMaxStrandCount);
  return take_rows(rows, element, read.notes, [&](uint64_t row) -> Status {
    const double count = list ? static_cast<double>(rows.list(*list).size())
                              : rows.value(segments ? *segments : *vertices) + (segments ? 1.0 : 0.0);
    if (!(count >= 0.0 && count <= kMaxSourceVertexCount))
      return make_error(ErrorCode::BadInput, "strand {} has {} vertices, allowed are up to {}", row, count,
                        kMaxSourceVertexCount);
    if (!list) {
      read.strand_counts.push_back(static_cast<uint32_t>(count));
      return {};
    }
    std::vector<uint32_t>& strand = read.strand_vertices.emplace_back();
    for (const double value : rows.list(*list)) {
      ASSIGN_OR_RETURN(const uint32_t index, vertex_index(value, "strand", row));
      strand.push_back(index);
    }
    return {};
  });
}

Status read_edges(PlyRows& rows, const PlyElement& element, PlyRowsRead& read) {
  const auto first = element.find({"vertex1"}, false), second = element.find({"vertex2"}, false);
  if (!first || !second)
    return make_error(ErrorCode::BadInput, "element 'edge' has no properties 'vertex1' and 'vertex2'");
  if (element.row_count > kMaxGroomVertices)
    return make_error(ErrorCode::LimitExceeded, "{} edges, at most {} are allowed", element.row_count,
                      kMaxGroomVertices);
  return take_rows(rows, element, read.notes, [&](uint64_t row) -> Status {
    ASSIGN_OR_RETURN(const uint32_t from, vertex_index(rows.value(*first), "edge", row));
    ASSIGN_OR_RETURN(const uint32_t to, vertex_index(rows.value(*second), "edge", row));
    read.edges.emplace_back(from, to);
    return {};
  });
}

Result<PlyRowsRead> read_rows(std::string_view file, const PlyHeader& header) {
  PlyRowsRead read;
  PlyRows rows(file, header);
  bool has_points = false;
  for (const PlyElement& element : header.element) {
    if (element.name == "vertex") {
      if (has_points) return make_error(ErrorCode::BadInput, "element 'vertex' stands there twice");
      has_points = true;
      RETURN_IF_ERROR(read_points(rows, element, read));
    } else if (is_strand_element(element.name)) {
      RETURN_IF_ERROR(read_strands(rows, element, read));
    } else if (element.name == "edge") {
      RETURN_IF_ERROR(read_edges(rows, element, read));
    } else {
      if (element.name == "face") read.face_count = element.row_count;
      RETURN_IF_ERROR(take_rows(rows, element, read.notes, [](uint64_t) { return Status(); }));
    }
  }
  if (rows.decimal_commas() > 0)
    read.notes.push_back(
        counted(rows.decimal_commas(), "number has a decimal comma", "numbers have a decimal comma"));
  if (const size_t left = rows.left_bytes(); left > 0) {
    BadItems beyond;
    beyond.add(make_error(ErrorCode::BadInput, "{} bytes are left after the last row", left), left);
    RETURN_IF_ERROR(beyond.judge(file.size(), "bytes"));
    read.notes.push_back(fmt::format("{} bytes after the last row are left out", left));
  }
  if (read.points.empty()) return make_error(ErrorCode::BadInput, "there are no points");
  return read;
}

/// Whether successive points lie no nearer to each other than any two. `count`: points of a strand.
bool are_shuffled(std::span<const glm::vec3> points, uint32_t count) {
  constexpr size_t kMinPoints = 200;     // fewer may be as wild as they like
  constexpr uint32_t kMinOfStrand = 10;  // of fewer, steps are as long as strands
  constexpr double kNearer = 0.75;
  if (points.size() < kMinPoints || count < kMinOfStrand) return false;
  std::vector<float> steps, jumps;
  for (size_t i = 0; i + 1 < points.size(); ++i) {
    const float step = glm::distance(points[i], points[i + 1]);
    const float jump = glm::distance(points[i], points[mix_u32(static_cast<uint32_t>(i)) % points.size()]);
    if (!std::isfinite(step) || !std::isfinite(jump)) continue;
    steps.push_back(step);
    jumps.push_back(jump);
  }
  return !steps.empty() && static_cast<double>(median(std::move(steps))) >
                               kNearer * static_cast<double>(median(std::move(jumps)));
}

/// Strands one after the other in the order of the file's points; a tenth of these at most may be left.
Result<Groom> strands_of_counts(std::vector<glm::vec3> points, const std::vector<uint32_t>& counts,
                                std::vector<std::string>& notes) {
  if (are_shuffled(points, static_cast<uint32_t>(points.size() / std::max<size_t>(counts.size(), 1))))
    return make_error(
        ErrorCode::BadInput,
        "{} points are in no order: from one to the next it is as far as to any other, so nobody "
        "can tell strands of them (export curves, or points from root to tip)",
        points.size());
  Groom groom;
  groom.offset.push_back(0);
  uint64_t total = 0;
  for (const uint32_t count : counts) {
    total += count;
    groom.offset.push_back(static_cast<uint32_t>(std::min<uint64_t>(total, kNoVertex)));
  }
  const Error is_another =
      make_error(ErrorCode::BadInput, "the strands need {} points, there are {}", total, points.size());
  if (total > points.size()) return is_another;
  if (total < points.size()) {
    BadItems left;
    left.add(is_another, points.size() - total);
    RETURN_IF_ERROR(left.judge(points.size(), "points"));
    notes.push_back(fmt::format("{} points that no strand has are left out", left.count()));
    points.resize(total);
  }
  groom.rest_position_m = std::move(points);
  return groom;
}

Result<Groom> strands_of_lists(const std::vector<glm::vec3>& points,
                               const std::vector<std::vector<uint32_t>>& strands) {
  Groom groom;
  groom.offset.push_back(0);
  for (size_t strand = 0; strand < strands.size(); ++strand) {
    if (groom.rest_position_m.size() + strands[strand].size() > kMaxGroomVertices)
      return make_error(ErrorCode::LimitExceeded, "more than {} vertices", kMaxGroomVertices);
    for (const uint32_t index : strands[strand]) {
      if (index >= points.size())
        return make_error(ErrorCode::BadInput, "strand {} names vertex {}, there are {}", strand, index,
                          points.size());
      groom.rest_position_m.push_back(points[index]);
    }
    groom.offset.push_back(static_cast<uint32_t>(groom.rest_position_m.size()));
  }
  return groom;
}

/// Vertices that edges join: each has at most one on either side.
using Neighbours = std::vector<std::array<uint32_t, 2>>;

Result<Neighbours> neighbours_of(size_t point_count,
                                 const std::vector<std::pair<uint32_t, uint32_t>>& edges) {
  Neighbours near(point_count, {kNoVertex, kNoVertex});
  const auto add = [&](uint32_t from, uint32_t to) -> Status {
    if (from >= point_count || to >= point_count)
      return make_error(ErrorCode::BadInput, "an edge names vertex {}, there are {}", std::max(from, to),
                        point_count);
    auto& sides = near[from];
    if (from == to || sides[0] == to)
      return make_error(ErrorCode::BadInput, "the edge from vertex {} to {} is no segment of a strand", from,
                        to);
    if (sides[1] != kNoVertex)
      return make_error(ErrorCode::BadInput, "three edges meet at vertex {}: strands do not branch", from);
    sides[sides[0] == kNoVertex ? 0 : 1] = to;
    return {};
  };
  for (const auto& [from, to] : edges) {
    RETURN_IF_ERROR(add(from, to));
    RETURN_IF_ERROR(add(to, from));
  }
  return near;
}

/// Chains of edges; each begins at the end that comes first in the file.
Result<Groom> strands_of_edges(const std::vector<glm::vec3>& points,
                               const std::vector<std::pair<uint32_t, uint32_t>>& edges,
                               std::vector<std::string>& notes) {
  ASSIGN_OR_RETURN(const Neighbours near, neighbours_of(points.size(), edges));
  Groom groom;
  groom.offset.push_back(0);
  std::vector<uint8_t> is_taken(points.size(), 0);
  size_t lone_points = 0;
  for (uint32_t root = 0; root < points.size(); ++root) {
    if (near[root][0] == kNoVertex) ++lone_points;
    if (is_taken[root] != 0 || near[root][0] == kNoVertex || near[root][1] != kNoVertex) continue;
    uint32_t before = kNoVertex;
    for (uint32_t vertex = root; vertex != kNoVertex;) {
      is_taken[vertex] = 1;
      groom.rest_position_m.push_back(points[vertex]);
      const uint32_t next = near[vertex][0] != before ? near[vertex][0] : near[vertex][1];
      before = std::exchange(vertex, next);
    }
    const size_t count = groom.rest_position_m.size() - groom.offset.back();
    if (count > kMaxSourceVertexCount || groom.offset.size() > kMaxStrandCount)
      return make_error(ErrorCode::LimitExceeded,
                        "edges make {} strands or a strand of {} vertices, at most {} and {} are allowed",
                        groom.offset.size(), count, kMaxStrandCount, kMaxSourceVertexCount);
    groom.offset.push_back(static_cast<uint32_t>(groom.rest_position_m.size()));
  }
  const size_t in_rings = points.size() - groom.rest_position_m.size() - lone_points;
  if (in_rings > 0)
    return make_error(ErrorCode::BadInput, "edges join {} points to rings: a strand has two ends", in_rings);
  if (lone_points > 0) notes.push_back(fmt::format("{} points that no edge joins are left out", lone_points));
  return groom;
}

/// What comments in the manner of our own exports say.
struct Statements {
  std::optional<float> unit_m;
  std::optional<bool> is_z_up;
  uint32_t strand_vertex_count = 0;
};

/// "unit_m 0.01", "up_axis Z" and "strand_vertex_count 16", each in a comment of its own.
Statements statements_of(const std::vector<std::string>& comments) {
  Statements said;
  for (const std::string& comment : comments) {
    TextScan scan(comment);
    if (!scan.next_line()) continue;
    const std::string_view key = scan.next_word(), value = scan.next_word();
    if (value.empty() || !scan.next_word().empty()) continue;
    if (key == "unit_m") {
      constexpr float kMostM = 1e3f;
      const auto unit_m = parse_number<float>(value);
      if (unit_m && *unit_m > 0.0f && *unit_m <= kMostM) said.unit_m = unit_m;
    } else if (key == "up_axis" && (value == "Y" || value == "Z")) {
      said.is_z_up = value == "Z";
    } else if (key == "strand_vertex_count") {
      said.strand_vertex_count = parse_number<uint32_t>(value).value_or(0);
    }
  }
  return said;
}

/// Bare points: so many of them to a strand.
Result<Groom> strands_of_points(std::vector<glm::vec3> points, uint32_t count,
                                std::vector<std::string>& notes) {
  if (count < kMinVertexCount || count > kMaxSourceVertexCount || points.size() % count != 0)
    return make_error(ErrorCode::BadInput,
                      "{} points are no strands of {} each; groom.file.strand_vertex_count says how many a "
                      "strand has",
                      points.size(), count);
  if (points.size() / count > kMaxStrandCount)
    return make_error(ErrorCode::LimitExceeded, "{} strands, at most {} are allowed: export fewer of them",
                      points.size() / count, kMaxStrandCount);
  const std::vector<uint32_t> counts(points.size() / count, count);
  return strands_of_counts(std::move(points), counts, notes);
}

Result<Groom> strands_of(PlyRowsRead read, uint32_t asked_count, uint32_t said_count,
                         std::vector<std::string>& notes) {
  if (asked_count != 0) return strands_of_points(std::move(read.points), asked_count, notes);
  if (!read.strand_vertices.empty()) return strands_of_lists(read.points, read.strand_vertices);
  if (!read.strand_counts.empty()) {
    // Where there are faces too, points behind the strands are theirs.
    const auto on_strands =
        std::accumulate(read.strand_counts.begin(), read.strand_counts.end(), uint64_t{0});
    if (read.face_count > 0 && on_strands < read.points.size()) read.points.resize(on_strands);
    return strands_of_counts(std::move(read.points), read.strand_counts, notes);
  }
  if (!read.edges.empty()) return strands_of_edges(read.points, read.edges, notes);
  if (said_count != 0) return strands_of_points(std::move(read.points), said_count, notes);
  if (read.face_count > 0)
    return make_error(
        ErrorCode::BadInput,
        "{} points and {} faces are a mesh, no strands (a head goes to head.mesh_path, as .obj)",
        read.points.size(), read.face_count);
  const Guess<uint32_t> guess = guess_strand_vertex_count(read.points);
  if (guess.value == 0)
    return make_error(ErrorCode::BadInput,
                      "{} points, and nothing says where strands begin; groom.file.strand_vertex_count says "
                      "how many points a strand has",
                      read.points.size());
  notes.push_back(fmt::format("{} points per strand: {} (groom.file.strand_vertex_count states it)",
                              guess.value, guess.reason));
  return strands_of_points(std::move(read.points), guess.value, notes);
}

}  // namespace

Guess<uint32_t> guess_strand_vertex_count(std::span<const glm::vec3> points) {
  // A step is a jump when it is so many times as long as the longer of those beside it.
  constexpr float kJump = 2.0f;
  constexpr double kLeastScore = 0.5;
  std::vector<uint32_t> jump_after;  // points after which one comes
  const auto step = [&](size_t i) { return glm::distance(points[i], points[i + 1]); };
  for (size_t i = 1; i + 2 < points.size(); ++i)
    if (step(i) > kJump * std::max(step(i - 1), step(i + 1))) jump_after.push_back(static_cast<uint32_t>(i));
  Guess<uint32_t> best;
  double best_score = kLeastScore;
  for (uint32_t count = kMinVertexCount; count <= kMaxSourceVertexCount && count < points.size(); ++count) {
    if (points.size() % count != 0) continue;
    const auto hits = std::count_if(jump_after.begin(), jump_after.end(),
                                    [count](uint32_t i) { return (i + 1) % count == 0; });
    const auto joints = static_cast<double>(points.size() / count - 1);
    const double hit_share = static_cast<double>(hits) / joints;
    const double score =
        hit_share * static_cast<double>(hits) / std::max(1.0, static_cast<double>(jump_after.size()));
    if (score <= best_score) continue;
    best_score = score;
    best.value = count;
    best.reason = fmt::format("{:.0f} % of the places where strands would meet are jumps, and {} elsewhere",
                              100.0 * hit_share, jump_after.size() - static_cast<size_t>(hits));
  }
  const bool is_usual =
      points.size() >= kUsualPlyStrandVertices && points.size() % kUsualPlyStrandVertices == 0;
  if (best.value == 0 && is_usual)
    best = {kUsualPlyStrandVertices, "the points do not say, and so many is what neural hair tools leave"};
  return best;
}

Result<StatedGroom> read_ply(std::span<const std::byte> file, uint32_t strand_vertex_count) {
  const std::string_view text =
      without_byte_order_mark({reinterpret_cast<const char*>(file.data()), file.size()});
  ASSIGN_OR_RETURN(const PlyHeader header, read_ply_header(text));
  ASSIGN_OR_RETURN(PlyRowsRead read, read_rows(text, header));
  const Statements said = statements_of(header.comment);
  StatedGroom stated;
  stated.notes = std::move(read.notes);
  stated.unit_m = said.unit_m;
  stated.is_z_up = said.is_z_up;
  stated.unit_reason = stated.up_axis_reason = "a comment of the file says so";
  ASSIGN_OR_RETURN(stated.groom,
                   strands_of(std::move(read), strand_vertex_count, said.strand_vertex_count, stated.notes));
  stated.groom = with_pinning(std::move(stated.groom), Pinning::Root);
  return with_usable_strands(std::move(stated));
}

Result<StatedGroom> load_ply(const std::filesystem::path& path, uint32_t strand_vertex_count) {
  ASSIGN_OR_RETURN(const std::vector<std::byte> bytes, load_file(path, kMaxGroomFileBytes));
  auto stated = read_ply(bytes, strand_vertex_count);
  if (!stated) return at(path.string(), stated.error());
  stated->groom.name = path.stem().string();
  return stated;
}

}  // namespace strandcast
