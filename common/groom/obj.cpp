// Wavefront OBJ reader.
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <string_view>

#include "common/base/file.h"
#include "common/base/file_kind.h"
#include "common/base/mercy.h"
#include "common/groom/mesh.h"
#include "common/groom/text_scan.h"

namespace strandcast {
namespace {

constexpr uint64_t kMaxMeshVertices = 3ull * kMaxMeshTriangles;
/// Of a file in millimetres that is taken for metres, whose fit is judged later.
constexpr float kMostReadM = 1000.0f * kMaxMeshExtentM;

/// What the file holds, indices resolved and checked.
struct ObjData {
  std::vector<glm::vec3> position;       // a bad one is where the one before it is
  std::vector<uint8_t> is_good;          // (position count)
  std::vector<glm::vec3> normal;         // as listed in the file
  std::vector<glm::vec3> corner_normal;  // (position count) sum over the corners that name a normal
  std::vector<glm::uvec3> triangle;
  uint64_t decimal_commas = 0;
};

/// Whether commas part the numbers of a vector: there are no blanks for it.
bool is_parted_by_commas(std::string_view rest) {
  return std::count(rest.begin(), rest.end(), ' ') + std::count(rest.begin(), rest.end(), '\t') < 2;
}

/// Numbers of a vector. A comma within a number is a decimal point, one behind it parts it from the next.
std::array<std::string, 3> vector_words(std::string_view rest) {
  std::array<std::string, 3> words;
  TextScan commas(rest);
  static_cast<void>(commas.next_line());
  const bool is_parted = is_parted_by_commas(rest);
  size_t begin = 0;
  for (std::string& word : words) {
    if (is_parted) {
      word = commas.next_word();
      continue;
    }
    begin = std::min(rest.find_first_not_of(" \t\v\f", begin), rest.size());
    const size_t end = std::min(rest.find_first_of(" \t\v\f", begin), rest.size());
    word = rest.substr(begin, end - begin);
    begin = end;
    if (word.ends_with(',')) word.pop_back();
    std::replace(word.begin(), word.end(), ',', '.');
  }
  return words;
}

Result<glm::vec3> read_vector(const TextScan& scan, const char* what) {
  glm::vec3 vector;
  const std::array<std::string, 3> words = vector_words(scan.rest());
  for (int axis = 0; axis < 3; ++axis) {
    const std::string& word = words[static_cast<size_t>(axis)];
    const auto value = parse_number<float>(word);
    if (!value || !std::isfinite(*value)) {
      return make_error(ErrorCode::BadInput, "{} is {}, a finite number is needed", what,
                        strandcast::quoted(word));
    }
    vector[axis] = *value;
  }
  return vector;
}

/// Turns an OBJ index (1-based, or negative from the end) into a 0-based one.
Result<uint32_t> resolve_index(std::string_view word, size_t count, const char* what) {
  const auto index = parse_number<int64_t>(word);
  if (!index)
    return make_error(ErrorCode::BadInput, "{} index is {}, a whole number is needed", what,
                      strandcast::quoted(word));
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
  if (data.is_good[corner.position] == 0)
    return make_error(ErrorCode::BadInput, "vertex {} could not be read", corner.position + 1);
  // A normal that is not there is computed.
  if (second + 1 > word.size()) return corner;
  if (const auto normal = resolve_index(word.substr(second + 1), data.normal.size(), "normal"))
    corner.normal = *normal;
  return corner;
}

Status read_face(TextScan& scan, ObjData& data) {
  std::vector<Corner> corners;
  for (std::string_view word = scan.next_word(); !word.empty(); word = scan.next_word()) {
    ASSIGN_OR_RETURN(const Corner corner, read_corner(word, data));
    corners.push_back(corner);
    if (data.triangle.size() + corners.size() > kMaxMeshTriangles + 2)
      return make_error(ErrorCode::LimitExceeded, "more than {} triangles", kMaxMeshTriangles);
  }
  if (corners.size() < 3)
    return make_error(ErrorCode::BadInput, "a face with {} corners, it needs at least 3", corners.size());
  for (const Corner& corner : corners)
    if (corner.normal >= 0)
      data.corner_normal[corner.position] += data.normal[static_cast<size_t>(corner.normal)];
  for (size_t i = 2; i < corners.size(); ++i)
    data.triangle.emplace_back(corners[0].position, corners[i - 1].position, corners[i].position);
  return {};
}

/// Whether a number of a vector has a decimal comma.
bool has_decimal_comma(std::string_view rest) {
  const size_t comma = rest.find(',');
  return comma != std::string_view::npos && comma + 1 < rest.size() && !is_parted_by_commas(rest) &&
         std::isdigit(static_cast<unsigned char>(rest[comma + 1])) != 0;
}

/// A vertex that cannot be read keeps its number.
Status read_vertex(const TextScan& scan, float unit_m, ObjData& data) {
  if (data.position.size() >= kMaxMeshVertices)
    return make_error(ErrorCode::LimitExceeded, "more than {} vertices", kMaxMeshVertices);
  const auto vertex = read_vector(scan, "coordinate");
  const glm::vec3 vertex_m = vertex ? *vertex * unit_m : glm::vec3(0.0f);
  const float largest = std::max({std::abs(vertex_m.x), std::abs(vertex_m.y), std::abs(vertex_m.z)});
  const bool is_good = vertex.ok() && largest <= kMostReadM;
  data.position.push_back(is_good || data.position.empty() ? vertex_m : data.position.back());
  data.is_good.push_back(is_good ? 1 : 0);
  data.corner_normal.emplace_back(0.0f);
  if (!vertex) return vertex.error();
  data.decimal_commas += has_decimal_comma(scan.rest()) ? 1 : 0;
  if (is_good) return {};
  return make_error(ErrorCode::BadInput, "a coordinate of {} m, allowed is +-{} m: check the unit", largest,
                    kMostReadM);
}

Status read_normal(const TextScan& scan, ObjData& data) {
  if (data.normal.size() >= kMaxMeshVertices)
    return make_error(ErrorCode::LimitExceeded, "more than {} normals", kMaxMeshVertices);
  const auto normal = read_vector(scan, "normal");
  const float length = normal ? glm::length(*normal) : 0.0f;
  data.normal.push_back(std::isfinite(length) && length > 0.0f ? *normal / length : glm::vec3(0.0f));
  return normal ? Status() : normal.error();
}

/// Reads what is known of a mesh; returns false for other statements.
Result<bool> read_statement(TextScan& scan, float unit_m, ObjData& data) {
  const std::string_view key = scan.next_word();
  Status read;
  if (key == "v")
    read = read_vertex(scan, unit_m, data);
  else if (key == "vn")
    read = read_normal(scan, data);
  else if (key == "f")
    read = read_face(scan, data);
  else
    return false;
  if (!read) return read.error();
  return true;
}

}  // namespace

Result<ObjMesh> load_obj(const std::filesystem::path& path, float unit_m) {
  ASSIGN_OR_RETURN(const std::string text, load_text(path, kMaxMeshFileBytes));
  Result<ObjMesh> mesh = parse_obj(text, path.string(), unit_m);
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  std::string kind = mesh ? std::string() : likely_kind(path);
  if (kind.empty() && extension != ".obj") kind = "of a head only Wavefront .obj is read: export it as that";
  if (mesh || kind.empty()) return mesh;
  Error error = mesh.error();
  error.message += "; " + kind;
  return error;
}

Result<ObjMesh> parse_obj(std::string_view text, const std::string& place, float unit_m) {
  if (!std::isfinite(unit_m) || unit_m <= 0.0f) {
    return at(place, make_error(ErrorCode::BadInput, "unit_m is {}, it has to be above 0", unit_m));
  }
  ObjData data;
  BadItems bad;
  uint64_t lines = 0;
  TextScan scan(without_byte_order_mark(text));
  while (scan.next_filled_line()) {
    const auto read = read_statement(scan, unit_m, data);
    lines += !read || *read ? 1 : 0;
    if (read) continue;
    Error problem = at(fmt::format("{}:{}", place, scan.line()), read.error());
    if (problem.code == ErrorCode::LimitExceeded) return problem;
    bad.add(std::move(problem));
  }
  ObjMesh mesh;
  RETURN_IF_ERROR(bad.settle(lines, "lines of the mesh", "and are left out", mesh.notes));
  if (data.decimal_commas > 0)
    mesh.notes.push_back(
        counted(data.decimal_commas, "vertex has decimal commas", "vertices have decimal commas"));
  if (data.triangle.empty()) return at(place, make_error(ErrorCode::BadInput, "the mesh has no faces"));
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
