// Alembic files put together object by object, as other programs would write them.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <string>
#include <utility>
#include <vector>

#include "client/export/abc_file.h"
#include "common/base/check.h"
#include "common/base/file.h"

namespace strandcast::test {

struct MadeCurves {
  std::string name = "hair";
  std::array<uint8_t, 4> kinds = {1, 0, 0, 0};  // type, wrap, basis, basis
  std::vector<int32_t> counts = {3, 2};
  std::vector<glm::vec3> points = {{0, 0, 0}, {0, 0, 1}, {0, 1, 2.5f}, {1, 0, 0}, {1, 0, -1}};
  std::vector<float> shift = {0};                   // of each sample, along x
  std::vector<std::vector<glm::vec3>> sample = {};  // points of each; empty: those above, shifted
};

class MadeAbc {
 public:
  explicit MadeAbc(const std::filesystem::path& path) : path_(path), file_(made(path)) {}

  template <class T>
  AbcEntry entry(const std::string& name, AbcForm form, AbcType type, uint32_t extent, const T& numbers,
                 const std::string& metadata = {}) {
    AbcEntry entry{name, form, type, extent, 0, metadata, {}, {}};
    CHECK(file_.append(entry.series, abc_bytes(numbers)).ok());
    return entry;
  }
  static AbcEntry compound(const std::string& name, std::vector<AbcEntry> entries) {
    return {name, AbcForm::Compound, AbcType::U8, 1, 0, "", {}, std::move(entries)};
  }
  /// A value for each strand or vertex; no scope where `scope` is empty.
  template <class T>
  AbcEntry param(const std::string& name, AbcType type, uint32_t extent, const T& numbers,
                 const std::string& scope = {}) {
    return entry(name, AbcForm::Array, type, extent, numbers,
                 scope.empty() ? std::string() : "geoScope=" + scope + ";isGeomParam=true");
  }

  AbcItem curves(MadeCurves made, std::vector<AbcEntry> own = {}, std::vector<AbcEntry> free = {}) {
    for (const float shift : made.sample.empty() ? made.shift : std::vector<float>()) {
      made.sample.push_back(made.points);
      for (glm::vec3& point : made.sample.back()) point.x += shift;
    }
    AbcEntry points{"P", AbcForm::Array, AbcType::Float, 3, made.sample.size() > 1 ? 1u : 0u, "", {}, {}};
    for (const std::vector<glm::vec3>& sample : made.sample)
      CHECK(file_.append(points.series, abc_bytes(sample)).ok());
    own.insert(own.begin(), points);
    own.push_back(entry("nVertices", AbcForm::Array, AbcType::I32, 1, made.counts));
    own.push_back(entry("curveBasisAndType", AbcForm::Scalar, AbcType::U8, 4, made.kinds));
    if (!free.empty()) own.push_back(compound(".arbGeomParams", std::move(free)));
    return {made.name, "schema=AbcGeom_Curve_v2", {compound(".geom", std::move(own))}, {}};
  }
  AbcItem xform(const std::vector<uint8_t>& ops, const std::vector<double>& channels, bool is_inheriting,
                std::vector<AbcItem> items) {
    std::vector<AbcEntry> own = {
        entry(".inherits", AbcForm::Scalar, AbcType::Bool, 1, std::array{uint8_t{is_inheriting}})};
    if (!ops.empty()) {
      const auto op_count = static_cast<uint32_t>(ops.size()), count = static_cast<uint32_t>(channels.size());
      own.push_back(entry(".ops", AbcForm::Scalar, AbcType::U8, op_count, ops));
      own.push_back(entry(".vals", AbcForm::Scalar, AbcType::Double, count, channels));
    }
    return {"xform", "schema=AbcGeom_Xform_v3", {compound(".xform", std::move(own))}, std::move(items)};
  }
  /// A transform that moves along x, with a sample for each shift.
  AbcItem moving_xform(const std::vector<double>& shift, std::vector<AbcItem> items) {
    constexpr uint8_t kTranslate = 0x10;
    AbcEntry channels{".vals", AbcForm::Scalar, AbcType::Double, 3, 1, "", {}, {}};
    for (const double x : shift)
      CHECK(file_.append(channels.series, abc_bytes(std::array{x, 0.0, 0.0})).ok());
    AbcEntry ops = entry(".ops", AbcForm::Scalar, AbcType::U8, 1, std::array{kTranslate});
    return {"xform", "schema=AbcGeom_Xform_v3", {compound(".xform", {ops, channels})}, std::move(items)};
  }
  AbcItem instance(const std::string& name, const std::string& source) {
    return {name,
            "isInstance=1",
            {entry(".instanceSource", AbcForm::Scalar, AbcType::String, 1, source + '\0')},
            {}};
  }

  /// Finishes the file and returns its bytes.
  std::vector<std::byte> finish(std::vector<AbcItem> items, const std::string& metadata = {}) {
    const AbcEvenTimes moving{0.5, 0.25};
    CHECK(file_.finish({"", "", {}, std::move(items)}, metadata, std::span(&moving, 1)).ok());
    auto bytes = load_file(path_, 64 << 20);
    CHECK(bytes.ok());
    return std::move(*bytes);
  }

 private:
  static AbcFile made(const std::filesystem::path& path) {
    auto file = AbcFile::create(path);
    CHECK(file.ok());
    return std::move(*file);
  }

  std::filesystem::path path_;
  AbcFile file_;
};

}  // namespace strandcast::test
