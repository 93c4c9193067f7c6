#include "common/groom/groom_file.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>

#include "common/base/text.h"
#include "common/groom/hair_loader.h"
#include "common/groom/head_fit.h"
#include "common/groom/resample.h"
#include "common/groom/tfx_loader.h"

namespace strandcast {
namespace {

/// Radii of the sphere through the roots of a human head, child to large adult with a wide hairline.
constexpr float kSmallestHeadRadiusM = 0.07f, kTypicalHeadRadiusM = 0.1f, kLargestHeadRadiusM = 0.12f;
constexpr float kCommonUnitsM[] = {1.0f, 0.01f, 0.001f, 0.0254f};  // metre, centimetre, millimetre, inch

Status check_options(const GroomFileOptions& options) {
  if (!std::isfinite(options.unit_m) || options.unit_m < 0.0f) {
    return make_error(ErrorCode::BadInput, "unit_m is {}, it has to be above 0, or 0 to be guessed",
                      options.unit_m);
  }
  if (!std::isfinite(options.origin.x) || !std::isfinite(options.origin.y) ||
      !std::isfinite(options.origin.z)) {
    return make_error(ErrorCode::BadInput, "origin is ({}, {}, {}), it has to be finite", options.origin.x,
                      options.origin.y, options.origin.z);
  }
  const uint32_t count = options.vertex_count;
  if (count != 0 && (count < kMinVertexCount || count > kMaxVertexCount)) {
    return make_error(ErrorCode::BadInput, "vertex_count is {}, allowed are 0 (keep) and {} to {}", count,
                      kMinVertexCount, kMaxVertexCount);
  }
  return {};
}

/// The beginning of a file that is text, "" for any other.
std::string text_beginning(const std::filesystem::path& path) {
  constexpr size_t kLookedAtBytes = 512, kShownChars = 40;
  std::string begin(kLookedAtBytes, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<size_t>(file.gcount()));
  const bool has_controls = std::any_of(begin.begin(), begin.end(), [](unsigned char c) {
    return c < ' ' && c != '\t' && c != '\n' && c != '\r';
  });
  return has_controls ? std::string() : one_line(begin.substr(0, begin.find('\n')), kShownChars);
}

/// A file that is text where none is expected is called that, whatever its bytes mean as numbers.
Error call_text(const std::filesystem::path& path, Error error) {
  const std::string begin = text_beginning(path);
  const bool is_text_format = path.extension() == ".tfx" && begin.starts_with("version 2");
  if (begin.empty() || is_text_format) return error;
  const char* hint = begin.starts_with("version 2") ? "it looks like a TressFX 2 file: call it .tfx"
                     : begin.starts_with("version https://git-lfs")
                         ? "it only stands for a file that Git LFS keeps: fetch that one"
                         : "a .hair file is binary, a .tfx file too or begins with 'version 2.0'";
  return at(path.string(), make_error(ErrorCode::BadInput, "this is text, \"{}\", and no {} file: {}", begin,
                                      path.extension().string(), hint));
}

Result<Groom> load_by_extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".tfx" || extension == ".hair") {
    auto groom = extension == ".tfx" ? load_tfx(path) : load_hair(path);
    if (groom || groom.error().code == ErrorCode::NotFound) return groom;
    return call_text(path, groom.error());
  }
  return at(path.string(), make_error(ErrorCode::Unsupported,
                                      "unknown groom file extension '{}', known: .tfx, .hair", extension));
}

uint32_t target_vertex_count(const Groom& groom, uint32_t wanted) {
  if (wanted != 0) return wanted;
  uint32_t largest = 0;
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand) {
    largest = std::max(largest, groom.vertex_count(strand));
  }
  return std::clamp(largest, kMinVertexCount, kMaxVertexCount);
}

}  // namespace

float guess_unit_m(const Groom& groom) {
  const float radius = fit_head_sphere(groom).radius_m;
  if (!std::isfinite(radius) || radius <= 0.0f) return 1.0f;
  for (const float unit_m : kCommonUnitsM) {
    if (radius * unit_m >= kSmallestHeadRadiusM && radius * unit_m <= kLargestHeadRadiusM) return unit_m;
  }
  return kTypicalHeadRadiusM / radius;
}

Result<Groom> load_groom(const GroomFileOptions& options) {
  if (const Status checked = check_options(options); !checked)
    return at(options.path.string(), checked.error());
  ASSIGN_OR_RETURN(Groom groom, load_by_extension(options.path));
  for (glm::vec3& point : groom.rest_position_m) {
    if (options.is_z_up) point = glm::vec3(point.x, point.z, -point.y);
  }
  groom.file_unit_m = options.unit_m > 0.0f ? options.unit_m : guess_unit_m(groom);
  for (glm::vec3& point : groom.rest_position_m) point = (point - options.origin) * groom.file_unit_m;
  // Before resampling, so that overflown coordinates never enter its sums.
  if (const Status checked = validate(groom); !checked) return at(options.path.string(), checked.error());
  const uint32_t vertex_count = target_vertex_count(groom, options.vertex_count);
  if (groom.uniform_vertex_count() != vertex_count) groom = resample(groom, vertex_count);
  if (options.pinning) groom = with_pinning(std::move(groom), *options.pinning);
  return groom;
}

}  // namespace strandcast
