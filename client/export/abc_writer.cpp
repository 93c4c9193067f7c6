// Alembic: one curves object below a transform that does nothing, with its points as samples, in the
// conventions that Unreal takes for grooms.
#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "client/export/abc_file.h"
#include "client/export/strand_writer.h"
#include "common/base/version.h"
#include "common/groom/abc_motion.h"

namespace strandcast {
namespace {

constexpr int16_t kAbcGroomMajor = 1, kAbcGroomMinor = 5;  // of Unreal's groom conventions
constexpr uint32_t kMoving = 1;                            // time sampling of what moves

std::string text_bytes(const std::string& text) {
  return text + '\0';
}

/// Metadata of a value for each strand or vertex.
std::string param_metadata(const char* scope, const char* interpretation, uint32_t extent, const char* type) {
  return fmt::format("arrayExtent=1;geoScope={}{};isGeomParam=true;podExtent={};podName={}", scope,
                     interpretation, extent, type);
}

class AbcWriter : public StrandWriter {
 public:
  AbcWriter(const ExportOptions& options, const StrandSet& strands, AbcFile file)
      : options_(options), strands_(strands), file_(std::move(file)) {
    half_width_ = 0.5 * *std::max_element(strands.widths().begin(), strands.widths().end());
  }

  Status begin() {
    RETURN_IF_ERROR(append_frame(strands_.rest_points(), points_, bounds_, half_width_));
    return append_head(strands_.rest_head_points());
  }

  Status write(const ExportFrame& frame) override {
    RETURN_IF_ERROR(append_frame(frame.points, points_, bounds_, half_width_));
    return append_head(strands_.head_points(frame.world_from_head));
  }

  Result<WrittenBytes> finish() override {
    AbcItem top;
    AbcItem& hair = top.items.emplace_back();
    hair.name = "Hair";
    hair.metadata = "schema=AbcGeom_Xform_v3;schemaObjTitle=AbcGeom_Xform_v3:.xform";
    RETURN_IF_ERROR(add_transform(hair));
    AbcItem& curves = hair.items.emplace_back();
    curves.name = "Strands";
    curves.metadata =
        "schema=AbcGeom_Curve_v2;schemaBaseType=AbcGeom_GeomBase_v1;schemaObjTitle=AbcGeom_Curve_v2:.geom";
    RETURN_IF_ERROR(add_curves(curves));
    if (!strands_.head_triangles().empty()) RETURN_IF_ERROR(add_head(hair.items.emplace_back()));
    const AbcEvenTimes moving{static_cast<double>(options_.first_number - 1) / options_.fps.hz(),
                              1.0 / options_.fps.hz()};
    ASSIGN_OR_RETURN(const uint64_t bytes, file_.finish(top, description(), std::span(&moving, 1)));
    return WrittenBytes{1, bytes, options_.path};
  }

 private:
  /// Adds a sample of points, and the box that is `room` larger than theirs.
  Status append_frame(std::span<const glm::dvec3> points, AbcSeries& series, AbcSeries& bounds, double room) {
    glm::dvec3 low = points.front(), high = low;
    numbers_.clear();
    for (const glm::dvec3& point : points) {
      low = glm::min(low, point);
      high = glm::max(high, point);
      for (int axis = 0; axis < 3; ++axis) numbers_.push_back(static_cast<float>(point[axis]));
    }
    RETURN_IF_ERROR(file_.append(series, abc_bytes(numbers_)));
    low -= room;
    high += room;
    return file_.append(bounds, abc_bytes(std::array{low.x, low.y, low.z, high.x, high.y, high.z}));
  }

  Status append_head(const std::vector<glm::dvec3>& points) {
    return points.empty() ? Status() : append_frame(points, head_points_, head_bounds_, 0.0);
  }

  /// Faces of Alembic go round clockwise.
  Status add_head(AbcItem& head) {
    head.name = "Head";
    head.metadata =
        "schema=AbcGeom_PolyMesh_v1;schemaBaseType=AbcGeom_GeomBase_v1;schemaObjTitle=AbcGeom_PolyMesh_v1:."
        "geom";
    const std::string schema = "schema=AbcGeom_PolyMesh_v1;schemaBaseType=AbcGeom_GeomBase_v1";
    AbcEntry geom{".geom", AbcForm::Compound, AbcType::U8, 1, 0, schema, {}, {}};
    std::vector<AbcEntry>& own = geom.entries;
    own.push_back(
        {".selfBnds", AbcForm::Scalar, AbcType::Double, 6, kMoving, "interpretation=box", head_bounds_, {}});
    own.push_back({"P",
                   AbcForm::Array,
                   AbcType::Float,
                   3,
                   kMoving,
                   "geoScope=vtx;interpretation=point",
                   head_points_,
                   {}});
    std::vector<int32_t> corners;
    for (const glm::uvec3& triangle : strands_.head_triangles())
      for (const uint32_t vertex : {triangle.z, triangle.y, triangle.x})
        corners.push_back(static_cast<int32_t>(vertex));
    RETURN_IF_ERROR(add(own, ".faceIndices", AbcForm::Array, AbcType::I32, 1, "", corners));
    RETURN_IF_ERROR(add(own, ".faceCounts", AbcForm::Array, AbcType::I32, 1, "",
                        std::vector<int32_t>(corners.size() / 3, 3)));
    head.entries.push_back(std::move(geom));
    return {};
  }

  /// Adds a property that stands still.
  template <class T>
  Status add(std::vector<AbcEntry>& entries, const char* name, AbcForm form, AbcType type, uint32_t extent,
             const std::string& metadata, const T& numbers) {
    AbcEntry& entry = entries.emplace_back(AbcEntry{name, form, type, extent, 0, metadata, {}, {}});
    return file_.append(entry.series, abc_bytes(numbers));
  }

  Status add_transform(AbcItem& hair) {
    AbcEntry xform{".xform", AbcForm::Compound, AbcType::U8, 1, 0, "schema=AbcGeom_Xform_v3", {}, {}};
    RETURN_IF_ERROR(
        add(xform.entries, ".inherits", AbcForm::Scalar, AbcType::Bool, 1, "", std::array{uint8_t{1}}));
    AbcEntry user{".userProperties", AbcForm::Compound, AbcType::U8, 1, 0, "", {}, {}};
    RETURN_IF_ERROR(add(user.entries, "groom_version_major", AbcForm::Scalar, AbcType::I16, 1, "",
                        std::array{kAbcGroomMajor}));
    RETURN_IF_ERROR(add(user.entries, "groom_version_minor", AbcForm::Scalar, AbcType::I16, 1, "",
                        std::array{kAbcGroomMinor}));
    RETURN_IF_ERROR(add(user.entries, "groom_tool", AbcForm::Scalar, AbcType::String, 1, "",
                        text_bytes(fmt::format("Strandcast {}", version()))));
    xform.entries.push_back(std::move(user));
    hair.entries.push_back(std::move(xform));
    return {};
  }

  Status add_curves(AbcItem& curves) {
    const std::string schema = "schema=AbcGeom_Curve_v2;schemaBaseType=AbcGeom_GeomBase_v1";
    AbcEntry geom{".geom", AbcForm::Compound, AbcType::U8, 1, 0, schema, {}, {}};
    std::vector<AbcEntry>& own = geom.entries;
    own.push_back(
        {".selfBnds", AbcForm::Scalar, AbcType::Double, 6, kMoving, "interpretation=box", bounds_, {}});
    own.push_back(
        {"P", AbcForm::Array, AbcType::Float, 3, kMoving, "geoScope=vtx;interpretation=point", points_, {}});
    RETURN_IF_ERROR(add(own, "nVertices", AbcForm::Array, AbcType::I32, 1, "", strands_.vertex_counts()));
    constexpr std::array<uint8_t, 4> kLinearOpen = {1, 0, 0, 0};
    RETURN_IF_ERROR(
        add(own, "curveBasisAndType", AbcForm::Scalar, AbcType::U8, kLinearOpen.size(), "", kLinearOpen));
    RETURN_IF_ERROR(add(own, "width", AbcForm::Array, AbcType::Float, 1,
                        param_metadata("vtx", "", 1, "float32_t"), strands_.widths()));
    AbcEntry free{".arbGeomParams", AbcForm::Compound, AbcType::U8, 1, 0, "", {}, {}};
    RETURN_IF_ERROR(add_groom(free.entries));
    own.push_back(std::move(free));
    curves.entries.push_back(std::move(geom));
    return {};
  }

  /// Adds what Unreal asks of each strand.
  Status add_groom(std::vector<AbcEntry>& entries) {
    RETURN_IF_ERROR(add(entries, "groom_group_id", AbcForm::Array, AbcType::I32, 1,
                        param_metadata("uni", "", 1, "int32_t"), strands_.groups()));
    if (const std::vector<std::string> names = strands_.names(); !names.empty()) {
      std::string texts;
      for (const std::string& name : names) texts += text_bytes(name);
      RETURN_IF_ERROR(add(entries, "groom_group_name", AbcForm::Array, AbcType::String, 1,
                          param_metadata("uni", "", 1, "string"), texts));
      entries.back().series.text_count = names.size();
    }
    RETURN_IF_ERROR(add(entries, "groom_guide", AbcForm::Array, AbcType::I16, 1,
                        param_metadata("uni", "", 1, "int16_t"), strands_.guides()));
    RETURN_IF_ERROR(add(entries, "groom_id", AbcForm::Array, AbcType::I32, 1,
                        param_metadata("uni", "", 1, "int32_t"), strands_.ids()));
    if (const StrandSet::Influence influence = strands_.influence(); !influence.id.empty()) {
      RETURN_IF_ERROR(add(entries, "groom_closest_guides", AbcForm::Array, AbcType::I32, 3,
                          param_metadata("uni", "", 3, "int32_t"), influence.id));
      RETURN_IF_ERROR(add(entries, "groom_guide_weights", AbcForm::Array, AbcType::Float, 3,
                          param_metadata("uni", "", 3, "float32_t"), influence.share));
    }
    return add(entries, "groom_root_uv", AbcForm::Array, AbcType::Float, 2,
               param_metadata("uni", ";interpretation=vector", 2, "float32_t"), strands_.root_uv());
  }

  /// Keys in their order. Alembic itself states neither unit nor axes.
  std::string description() const {
    return fmt::format(
        "_ai_Application=Strandcast {};_ai_DCC_FPS={:.6f};_ai_Description={} strands of {} vertices, root "
        "first, in {}. {}, the motion begins at sample 1.;unit_m={:.7g};up_axis={}",
        version(), options_.fps.hz(), strands_.strand_count(), strands_.vertex_count(),
        options_.space == ExportSpace::Head ? "the head's own space" : "the world", kAbcRestSample,
        options_.unit_m, options_.up == ExportUp::Y ? 'Y' : 'Z');
  }

  const ExportOptions options_;
  const StrandSet& strands_;
  AbcFile file_;
  double half_width_ = 0.0;
  AbcSeries points_, bounds_;
  AbcSeries head_points_, head_bounds_;
  std::vector<float> numbers_;  // of one frame, kept for its memory
};

}  // namespace

Result<std::unique_ptr<StrandWriter>> make_abc_writer(const ExportOptions& options,
                                                      const StrandSet& strands) {
  ASSIGN_OR_RETURN(AbcFile file, AbcFile::create(options.path));
  auto writer = std::make_unique<AbcWriter>(options, strands, std::move(file));
  RETURN_IF_ERROR(writer->begin());
  return std::unique_ptr<StrandWriter>(std::move(writer));
}

}  // namespace strandcast
