// Wavefront OBJ reader.
#include <algorithm>
#include <cmath>
#include <string_view>

#include "common/base/file.h"
#include "common/groom/mesh.h"
#include "common/groom/text_scan.h"

namespace strandcast {
namespace {

constexpr uint64_t kMaxMeshVertices = 3ull * kMaxMeshTriangles;

/// What the file holds, indices resolved and checked.
struct ObjData {
  std::vector<glm::vec3> position;
  std::vector<glm::vec3> normal;         // as listed in the file
  std::vector<glm::vec3> corner_normal;  // (position count) sum over the corners that name a normal
  std::vector<glm::uvec3> triangle;
};

Result<glm::vec3> read_vector(TextScan& scan, const char* what) {
  glm::vec3 vector;
  for (int axis = 0; axis < 3; ++axis) {
    const std::string_view word = scan.next_word();
    const auto value = parse_number<float>(word);
    if (!value || !std::isfinite(*value)) {
      return make_error(ErrorCode::BadInput, "{} is {}, a finite number is needed", what, quoted(word));
    }
    vector[axis] = *value;
  }
  return vector;
}

/// Turns an OBJ index (1-based, or negative from the end) into a 0-based one.
Result<uint32_t> resolve_index(std::string_view word, size_t count, const char* what) {
  const auto index = parse_number<int64_t>(word);
  if (!index)
    return make_error(ErrorCode::BadInput, "{} index is {}, a whole number is needed", what, quoted(word));
  const auto last = static_cast<int64_t>(count);
  const int64_t resolved = *index < 0 ? *index + last : *index - 1;
  if (*index != 0 && *index >= -last && *index <= last) return static_cast<uint32_t>(resolved);
  return make_error(ErrorCode::BadInput, "{} index {} does not exist, {} are known up to here", what, *index,
                    last);
}

struct Corner {
  uint32_t position = 0;
  int64_t normal = -1;  // -1 = none
};

/// One corner of a face: v, v/vt, v//vn or v/vt/vn.
Result<Corner> read_corner(std::string_view word, const ObjData& data) {
  const size_t first = std::min(word.find('/'), word.size());
  const size_t second = std::min(word.find('/', std::min(first + 1, word.size())), word.size());
  Corner corner;
  ASSIGN_OR_RETURN(corner.position, resolve_index(word.substr(0, first), data.position.size(), "vertex"));
  if (second + 1 > word.size()) return corner;
  ASSIGN_OR_RETURN(corner.normal, resolve_index(word.substr(second + 1), data.normal.size(), "normal"));
  return corner;
}

Status read_face(TextScan& scan, ObjData& data) {
  Corner first, previous;
  uint32_t count = 0;
  for (std::string_view word = scan.next_word(); !word.empty(); word = scan.next_word()) {
    ASSIGN_OR_RETURN(const Corner corner, read_corner(word, data));
    if (corner.normal >= 0) {
      data.corner_normal[corner.position] += data.normal[static_cast<size_t>(corner.normal)];
    }
    if (count == 0) first = corner;
    if (count >= 2) {
      if (data.triangle.size() >= kMaxMeshTriangles) {
        return make_error(ErrorCode::LimitExceeded, "more than {} triangles", kMaxMeshTriangles);
      }
      data.triangle.emplace_back(first.position, previous.position, corner.position);
    }
    previous = corner;
    ++count;
  }
  if (count < 3) return make_error(ErrorCode::BadInput, "a face with {} corners, it needs at least 3", count);
  return {};
}

Status read_statement(TextScan& scan, float unit_m, ObjData& data) {
  const std::string_view key = scan.next_word();
  if (key == "v") {
    if (data.position.size() >= kMaxMeshVertices) {
      return make_error(ErrorCode::LimitExceeded, "more than {} vertices", kMaxMeshVertices);
    }
    ASSIGN_OR_RETURN(const glm::vec3 vertex, read_vector(scan, "coordinate"));
    const glm::vec3 vertex_m = vertex * unit_m;
    const float largest = std::max({std::abs(vertex_m.x), std::abs(vertex_m.y), std::abs(vertex_m.z)});
    if (largest > kMaxMeshExtentM) {
      return make_error(ErrorCode::BadInput, "a coordinate of {} m, allowed is +-{} m: check the unit",
                        largest, kMaxMeshExtentM);
    }
    data.position.push_back(vertex_m);
    data.corner_normal.emplace_back(0.0f);
    return {};
  }
  if (key == "vn") {
    if (data.normal.size() >= kMaxMeshVertices) {
      return make_error(ErrorCode::LimitExceeded, "more than {} normals", kMaxMeshVertices);
    }
    ASSIGN_OR_RETURN(glm::vec3 normal, read_vector(scan, "normal"));
    const float length = glm::length(normal);
    data.normal.push_back(std::isfinite(length) && length > 0.0f ? normal / length : glm::vec3(0.0f));
    return {};
  }
  if (key == "f") return read_face(scan, data);
  return {};
}

}  // namespace

Result<Mesh> load_obj(const std::filesystem::path& path, float unit_m) {
  ASSIGN_OR_RETURN(const std::string text, load_text(path, kMaxMeshFileBytes));
  return parse_obj(text, path.string(), unit_m);
}

Result<Mesh> parse_obj(std::string_view text, const std::string& place, float unit_m) {
  if (!std::isfinite(unit_m) || unit_m <= 0.0f) {
    return at(place, make_error(ErrorCode::BadInput, "unit_m is {}, it has to be above 0", unit_m));
  }
  ObjData data;
  TextScan scan(text);
  while (scan.next_filled_line()) {
    const Status read = read_statement(scan, unit_m, data);
    if (!read) return at(fmt::format("{}:{}", place, scan.line()), read.error());
  }
  if (data.triangle.empty()) return at(place, make_error(ErrorCode::BadInput, "the mesh has no faces"));
  Mesh mesh;
  mesh.normal = compute_normals(data.position, data.triangle);
  for (size_t i = 0; i < mesh.normal.size(); ++i) {
    const float length = glm::length(data.corner_normal[i]);
    constexpr float kMinLength = 1e-3f;  // opposite normals cancel out: the faces' own normal serves better
    if (length > kMinLength) mesh.normal[i] = data.corner_normal[i] / length;
  }
  mesh.position_m = std::move(data.position);
  mesh.triangle = std::move(data.triangle);
  return mesh;
}

}  // namespace strandcast
