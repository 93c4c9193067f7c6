// Binary USD, alone or in a package: what usda_writer.cpp writes as text.
#include <algorithm>
#include <bit>
#include <string>
#include <utility>
#include <vector>

#include "client/export/strand_writer.h"
#include "client/export/usdc_file.h"
#include "common/groom/usd_loader.h"

namespace strandcast {
namespace {

/// A property's values at the times of the frames.
struct Series {
  std::vector<UsdcValue> value;
  std::vector<glm::vec3> last;  // what the last value holds
};

class UsdcWriter : public StrandWriter {
 public:
  UsdcWriter(const ExportOptions& options, const StrandSet& strands, UsdcFile file)
      : options_(options), strands_(strands), file_(std::move(file)) {
    half_width_ = 0.5 * *std::max_element(strands.widths().begin(), strands.widths().end());
  }

  Status begin() {
    return append_frame(options_.first_number - 1, strands_.rest_points(), strands_.rest_head_points());
  }

  Status write(const ExportFrame& frame) override {
    const bool has_moving_head = options_.has_head && options_.space == ExportSpace::World;
    return append_frame(
        frame.number, frame.points,
        has_moving_head ? strands_.head_points(frame.world_from_head) : std::vector<glm::dvec3>());
  }

  Result<WrittenBytes> finish() override {
    UsdcItem root{"", UsdcKind::Root, {}, {}};
    RETURN_IF_ERROR(describe_layer(root));
    UsdcItem hair = prim("Hair", "Xform");
    hair.fields.emplace_back("kind", file_.token("component"));
    if (is_of_matter()) {
      matter_item_ = root.count() + hair.count();  // what is before it
      hair.items.push_back(prim("Matter", "Material"));
      RETURN_IF_ERROR(describe_material(hair.items.back()));
    }
    UsdcItem curves = prim("Strands", "BasisCurves");
    RETURN_IF_ERROR(describe_curves(curves));
    hair.items.push_back(std::move(curves));
    if (!head_.value.empty()) {
      UsdcItem head = prim("Head", "Mesh");
      RETURN_IF_ERROR(describe_head(head));
      hair.items.push_back(std::move(head));
    }
    root.items.push_back(std::move(hair));
    ASSIGN_OR_RETURN(const uint64_t bytes, file_.finish(std::move(root)));
    return WrittenBytes{1, bytes, options_.path};
  }

 private:
  Status append_frame(int64_t time_code, std::span<const glm::dvec3> points,
                      const std::vector<glm::dvec3>& head) {
    times_.push_back(static_cast<double>(time_code));
    glm::dvec3 low = points.front(), high = low;
    for (const glm::dvec3& point : points) {
      low = glm::min(low, point);
      high = glm::max(high, point);
    }
    RETURN_IF_ERROR(append(points_, std::vector<glm::vec3>(points.begin(), points.end())));
    RETURN_IF_ERROR(append(extent_, {glm::vec3(low - half_width_), glm::vec3(high + half_width_)}));
    return head.empty() ? Status() : append(head_, std::vector<glm::vec3>(head.begin(), head.end()));
  }

  /// What is as in the last frame takes no space.
  Status append(Series& series, std::vector<glm::vec3> items) {
    if (series.value.empty() || series.last != items) {
      ASSIGN_OR_RETURN(const UsdcValue value,
                       file_.array(UsdcType::Vec3f, items.size(), std::as_bytes(std::span(items))));
      series.value.push_back(value);
      series.last = std::move(items);
    } else {
      series.value.push_back(UsdcValue(series.value.back()));
    }
    return {};
  }

  UsdcItem prim(const std::string& name, const std::string& type) {
    const UsdcValue defined = UsdcValue::of(UsdcType::Specifier, 0, UsdcValue::kInlined);
    return {name, UsdcKind::Prim, {{"specifier", defined}, {"typeName", file_.token(type)}}, {}};
  }
  UsdcItem& add(UsdcItem& prim, const std::string& name, const std::string& type, UsdcValue value) {
    return prim.items.emplace_back(
        UsdcItem{name, UsdcKind::Attribute, {{"typeName", file_.token(type)}, {"default", value}}, {}});
  }
  void add_word(UsdcItem& prim, const std::string& name, const std::string& word) {
    const UsdcValue uniform = UsdcValue::of(UsdcType::Variability, 1, UsdcValue::kInlined);
    add(prim, name, "token", file_.token(word)).fields.emplace_back("variability", uniform);
  }
  Status add_ints(UsdcItem& prim, const std::string& name, std::span<const int32_t> numbers,
                  const std::string& interpolation = {}) {
    ASSIGN_OR_RETURN(const UsdcValue value, file_.ints(numbers));
    UsdcItem& added = add(prim, name, "int[]", value);
    if (!interpolation.empty()) added.fields.emplace_back("interpolation", file_.token(interpolation));
    return {};
  }
  Status add_series(UsdcItem& prim, const std::string& name, const std::string& type, const Series& series) {
    UsdcItem& added = add(prim, name, type, series.value.front());
    if (series.value.size() < 2) return {};
    ASSIGN_OR_RETURN(const UsdcValue samples, file_.samples(times_, series.value));
    added.fields.emplace_back("timeSamples", samples);
    return {};
  }

  Status describe_layer(UsdcItem& root) {
    const auto first = static_cast<double>(options_.first_number);
    root.fields = {{"defaultPrim", file_.token("Hair")},
                   {"documentation", file_.string(usd_description(options_, strands_))},
                   {"upAxis", file_.token(options_.up == ExportUp::Y ? "Y" : "Z")}};
    for (const auto& [name, value] : {std::pair("metersPerUnit", options_.unit_m),
                                      {"startTimeCode", first},
                                      {"endTimeCode", std::max(times_.back(), first)},
                                      {"timeCodesPerSecond", options_.fps.hz()},
                                      {"framesPerSecond", options_.fps.hz()}}) {
      ASSIGN_OR_RETURN(const UsdcValue number, file_.number(value));
      root.fields.emplace_back(name, number);
    }
    return {};
  }

  Status describe_curves(UsdcItem& curves) {
    std::vector<std::string> schemas = {"GroomAPI"};
    if (is_of_matter()) schemas.insert(schemas.end(), {kUsdCurvesSchema, kUsdBindingSchema});
    ASSIGN_OR_RETURN(const UsdcValue schema, file_.prepended_tokens(schemas));
    curves.fields.emplace_back("apiSchemas", schema);
    add_word(curves, "type", "linear");
    add_word(curves, "wrap", "nonperiodic");
    const std::vector<uint32_t>& counts = strands_.vertex_counts();
    RETURN_IF_ERROR(
        add_ints(curves, "curveVertexCounts", std::vector<int32_t>(counts.begin(), counts.end())));
    const std::span<const float> widths(strands_.widths());
    ASSIGN_OR_RETURN(const UsdcValue width,
                     file_.array(UsdcType::Float, widths.size(), std::as_bytes(widths)));
    add(curves, "widths", "float[]", width).fields.emplace_back("interpolation", file_.token("vertex"));
    for (const auto& [name, number] : {std::pair("userProperties:groom_version_major", kUsdGroomMajor),
                                       {"userProperties:groom_version_minor", kUsdGroomMinor}})
      add(curves, name, "int", UsdcValue::of(UsdcType::Int, number, UsdcValue::kInlined))
          .fields.emplace_back("custom", UsdcValue::of(UsdcType::Bool, 1, UsdcValue::kInlined));
    RETURN_IF_ERROR(describe_groom(curves));
    if (is_of_matter()) RETURN_IF_ERROR(describe_matter(curves));
    RETURN_IF_ERROR(add_series(curves, "points", "point3f[]", points_));
    return add_series(curves, "extent", "float3[]", extent_);
  }

  bool is_of_matter() const { return strands_.material().is_known(); }

  Status describe_material(UsdcItem& material) {
    const std::vector<std::string> schemas = {kUsdMaterialSchema};
    ASSIGN_OR_RETURN(const UsdcValue schema, file_.prepended_tokens(schemas));
    material.fields.emplace_back("apiSchemas", schema);
    for (const auto& [name, value] : usd_material(strands_))
      add(material, name, "float",
          UsdcValue::of(UsdcType::Float, std::bit_cast<uint32_t>(static_cast<float>(value)),
                        UsdcValue::kInlined));
    return {};
  }

  /// Adds what binds curves to their material, and their rest shape.
  Status describe_matter(UsdcItem& curves) {
    ASSIGN_OR_RETURN(const UsdcValue target, file_.target(matter_item_));
    curves.items.push_back({std::string(kUsdBinding), UsdcKind::Relationship, {{"targetPaths", target}}, {}});
    if (const auto diameter = strands_.material().diameter) {
      const auto narrow = static_cast<float>(*diameter);
      ASSIGN_OR_RETURN(const UsdcValue one,
                       file_.array(UsdcType::Float, 1, std::as_bytes(std::span(&narrow, 1))));
      add(curves, std::string(kUsdThicknesses), "float[]", one);
      add_word(curves, std::string(kUsdThicknesses) + ":elementType", "constant");
    }
    add(curves, std::string(kUsdRestPoints), "point3f[]", points_.value.front());
    return {};
  }

  /// Adds what Unreal asks of each strand.
  Status describe_groom(UsdcItem& curves) {
    const std::vector<int16_t> guides = strands_.guides();
    RETURN_IF_ERROR(add_ints(curves, "primvars:groom_guide",
                             std::vector<int32_t>(guides.begin(), guides.end()), "uniform"));
    RETURN_IF_ERROR(add_ints(curves, "primvars:groom_group_id", strands_.groups(), "uniform"));
    RETURN_IF_ERROR(add_ints(curves, "primvars:groom_id", strands_.ids(), "uniform"));
    if (const std::vector<std::string> names = strands_.names(); !names.empty()) {
      ASSIGN_OR_RETURN(const UsdcValue texts, file_.strings(names));
      add(curves, "primvars:groom_group_name", "string[]", texts)
          .fields.emplace_back("interpolation", file_.token("uniform"));
    }
    const std::vector<glm::vec2> uv = strands_.root_uv();
    ASSIGN_OR_RETURN(const UsdcValue root_uv,
                     file_.array(UsdcType::Vec2f, uv.size(), std::as_bytes(std::span(uv))));
    add(curves, "primvars:groom_root_uv", "texCoord2f[]", root_uv)
        .fields.emplace_back("interpolation", file_.token("uniform"));
    return {};
  }

  Status describe_head(UsdcItem& head) {
    add_word(head, "subdivisionScheme", "none");
    std::vector<int32_t> corners;
    for (const glm::uvec3& triangle : strands_.head_triangles())
      for (const uint32_t vertex : {triangle.x, triangle.y, triangle.z})
        corners.push_back(static_cast<int32_t>(vertex));
    RETURN_IF_ERROR(add_ints(head, "faceVertexCounts", std::vector<int32_t>(corners.size() / 3, 3)));
    RETURN_IF_ERROR(add_ints(head, "faceVertexIndices", corners));
    return add_series(head, "points", "point3f[]", head_);
  }

  const ExportOptions options_;
  const StrandSet& strands_;
  UsdcFile file_;
  double half_width_ = 0.0;
  std::vector<double> times_;  // of all frames
  Series points_, extent_, head_;
  uint32_t matter_item_ = 0;
};

}  // namespace

Result<std::unique_ptr<StrandWriter>> make_usdc_writer(const ExportOptions& options,
                                                       const StrandSet& strands) {
  ASSIGN_OR_RETURN(UsdcFile file, UsdcFile::create(options.path));
  auto writer = std::make_unique<UsdcWriter>(options, strands, std::move(file));
  RETURN_IF_ERROR(writer->begin());
  return std::unique_ptr<StrandWriter>(std::move(writer));
}

}  // namespace strandcast
