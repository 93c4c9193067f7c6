// USD text: one BasisCurves with its points as time samples, in the conventions that Unreal takes for grooms.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "client/export/number_text.h"
#include "client/export/strand_writer.h"
#include "common/base/output_file.h"
#include "common/base/worker_pool.h"
#include "common/groom/usd_loader.h"

namespace strandcast {
namespace {

constexpr size_t kPointsPerPiece = 4'096;
constexpr size_t kMostPointChars = 3 * kMostDecimalChars + 8;  // "(x, y, z), "

struct Extent {
  glm::dvec3 low, high;
};

class UsdaWriter : public StrandWriter {
 public:
  UsdaWriter(const ExportOptions& options, const StrandSet& strands, OutputFile file)
      : options_(options), strands_(strands), file_(std::move(file)) {
    half_width_ = 0.5 * *std::max_element(strands.widths().begin(), strands.widths().end());
  }

  Status begin() {
    RETURN_IF_ERROR(file_.append(layer_text() + material_text() + curves_text()));
    const std::vector<glm::dvec3> rest = strands_.rest_points();
    if (is_of_matter()) {
      RETURN_IF_ERROR(file_.append(fmt::format("        point3f[] {} = ", kUsdRestPoints)));
      RETURN_IF_ERROR(append_points(rest));
      RETURN_IF_ERROR(file_.append("\n"));
    }
    RETURN_IF_ERROR(file_.append("        point3f[] points = "));
    RETURN_IF_ERROR(append_points(rest));
    RETURN_IF_ERROR(file_.append("\n        point3f[] points.timeSamples = {\n"));
    return append_sample(options_.first_number - 1, rest);
  }

  Status write(const ExportFrame& frame) override {
    last_frame_ = frame.number;
    if (has_moving_head()) head_poses_.push_back(frame.world_from_head);
    return append_sample(frame.number, frame.points);
  }

  Result<WrittenBytes> finish() override {
    RETURN_IF_ERROR(file_.append("        }\n        float3[] extent = "));
    RETURN_IF_ERROR(
        file_.append(extent_text(extents_.front()) + "\n        float3[] extent.timeSamples = {\n"));
    for (size_t frame = 0; frame < extents_.size(); ++frame)
      RETURN_IF_ERROR(
          file_.append(fmt::format("            {}: {},\n", number_of(frame), extent_text(extents_[frame]))));
    RETURN_IF_ERROR(file_.append("        }\n    }\n"));
    RETURN_IF_ERROR(append_head());
    RETURN_IF_ERROR(file_.append("}\n"));
    RETURN_IF_ERROR(file_.patch(end_time_at_, fmt::format("{}", last_frame_)));
    const uint64_t bytes = file_.size_bytes();
    RETURN_IF_ERROR(file_.finish());
    return WrittenBytes{1, bytes, options_.path};
  }

 private:
  std::string layer_text() {
    std::string text = "#usda 1.0\n(\n";
    text += "    defaultPrim = \"Hair\"\n";
    text += fmt::format("    doc = \"{}\"\n", usd_description(options_, strands_));
    text += fmt::format("    metersPerUnit = {:.7g}\n", options_.unit_m);
    text += fmt::format("    upAxis = \"{}\"\n", options_.up == ExportUp::Y ? 'Y' : 'Z');
    text += fmt::format("    startTimeCode = {}\n    endTimeCode = ", options_.first_number);
    end_time_at_ = text.size();
    // How many frames there will be is known at the end.
    text.append(20, ' ');
    text += '\n';
    text += fmt::format("    timeCodesPerSecond = {}\n    framesPerSecond = {}\n", options_.fps.hz(),
                        options_.fps.hz());
    text += ")\n\ndef Xform \"Hair\" (\n    kind = \"component\"\n)\n{\n";
    return text;
  }

  bool is_of_matter() const { return strands_.material().is_known(); }

  /// As in the proposal for deformable bodies of USD's physics, which is not part of USD yet.
  std::string material_text() const {
    if (!is_of_matter()) return {};
    std::string text =
        fmt::format("    def Material \"Matter\" (\n        prepend apiSchemas = [\"{}\"]\n    )\n    {{\n",
                    kUsdMaterialSchema);
    for (const auto& [name, value] : usd_material(strands_))
      text += fmt::format("        float {} = {:.9g}\n", name, value);
    return text + "    }\n";
  }

  std::string curves_text() const {
    const std::string more =
        is_of_matter() ? fmt::format(", \"{}\", \"{}\"", kUsdCurvesSchema, kUsdBindingSchema) : "";
    std::string text = fmt::format(
        "    def BasisCurves \"Strands\" (\n        prepend apiSchemas = [\"GroomAPI\"{}]\n    )\n    {{\n",
        more);
    if (is_of_matter()) text += fmt::format("        rel {} = </Hair/Matter>\n", kUsdBinding);
    if (const auto diameter = strands_.material().diameter)
      text +=
          fmt::format("        float[] {} = [{:.9g}]\n        uniform token {}:elementType = \"constant\"\n",
                      kUsdThicknesses, *diameter, kUsdThicknesses);
    text += "        uniform token type = \"linear\"\n        uniform token wrap = \"nonperiodic\"\n";
    text +=
        fmt::format("        int[] curveVertexCounts = [{}]\n", fmt::join(strands_.vertex_counts(), ", "));
    text += fmt::format("        float[] widths = [{:.6g}]", fmt::join(strands_.widths(), ", ")) +
            " (\n            interpolation = \"vertex\"\n        )\n";
    text += fmt::format("        custom int userProperties:groom_version_major = {}\n", kUsdGroomMajor);
    text += fmt::format("        custom int userProperties:groom_version_minor = {}\n", kUsdGroomMinor);
    const std::string uniform = " (\n            interpolation = \"uniform\"\n        )\n";
    text += fmt::format("        int[] primvars:groom_guide = [{}]", fmt::join(strands_.guides(), ", ")) +
            uniform;
    text += fmt::format("        int[] primvars:groom_group_id = [{}]", fmt::join(strands_.groups(), ", ")) +
            uniform;
    text += fmt::format("        int[] primvars:groom_id = [{}]", fmt::join(strands_.ids(), ", ")) + uniform;
    if (const std::vector<std::string> names = strands_.names(); !names.empty())
      text += "        string[] primvars:groom_group_name = [" + quoted_text(names) + "]" + uniform;
    text += "        texCoord2f[] primvars:groom_root_uv = " + root_uv_text() + uniform;
    return text;
  }

  /// What would end a string is replaced.
  static std::string quoted_text(const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) {
      text += text.empty() ? "\"" : ", \"";
      for (const char c : name) text += c == '"' || c == '\\' || (c >= 0 && c < ' ') ? '_' : c;
      text += '"';
    }
    return text;
  }

  std::string root_uv_text() const {
    std::string text = "[";
    for (const glm::vec2& uv : strands_.root_uv())
      text += fmt::format("{}({:.8g}, {:.8g})", text.size() > 1 ? ", " : "", uv.x, uv.y);
    return text + "]";
  }

  std::string extent_text(const Extent& extent) const {
    const glm::dvec3 low = extent.low - half_width_, high = extent.high + half_width_;
    return fmt::format("[({:.7g}, {:.7g}, {:.7g}), ({:.7g}, {:.7g}, {:.7g})]", low.x, low.y, low.z, high.x,
                       high.y, high.z);
  }

  /// Of a sample; the first is the rest shape.
  int64_t number_of(size_t sample) const { return options_.first_number - 1 + static_cast<int64_t>(sample); }

  bool has_moving_head() const { return options_.has_head && options_.space == ExportSpace::World; }

  /// Adds the head as a mesh, with samples where it moves.
  Status append_head() {
    const std::vector<glm::dvec3> rest = strands_.rest_head_points();
    if (rest.empty()) return {};
    std::string text = "    def Mesh \"Head\"\n    {\n        uniform token subdivisionScheme = \"none\"\n";
    std::vector<uint32_t> corners;
    for (const glm::uvec3& triangle : strands_.head_triangles())
      corners.insert(corners.end(), {triangle.x, triangle.y, triangle.z});
    const std::vector<int> counts(corners.size() / 3, 3);
    text += fmt::format("        int[] faceVertexCounts = [{}]\n", fmt::join(counts, ", "));
    text += fmt::format("        int[] faceVertexIndices = [{}]\n", fmt::join(corners, ", "));
    RETURN_IF_ERROR(file_.append(text + "        point3f[] points = "));
    RETURN_IF_ERROR(append_points(rest));
    if (!head_poses_.empty()) {
      RETURN_IF_ERROR(file_.append(
          fmt::format("\n        point3f[] points.timeSamples = {{\n            {}: ", number_of(0))));
      RETURN_IF_ERROR(append_points(rest));
      for (size_t i = 0; i < head_poses_.size(); ++i) {
        RETURN_IF_ERROR(file_.append(fmt::format(",\n            {}: ", number_of(i + 1))));
        RETURN_IF_ERROR(append_points(strands_.head_points(head_poses_[i])));
      }
      RETURN_IF_ERROR(file_.append(",\n        }"));
    }
    return file_.append("\n    }\n");
  }

  Status append_sample(int64_t time_code, std::span<const glm::dvec3> points) {
    Extent extent{points.front(), points.front()};
    for (const glm::dvec3& point : points)
      extent = {glm::min(extent.low, point), glm::max(extent.high, point)};
    extents_.push_back(extent);
    RETURN_IF_ERROR(file_.append(fmt::format("            {}: ", time_code)));
    RETURN_IF_ERROR(append_points(points));
    return file_.append(",\n");
  }

  /// Pieces are made side by side and written in their order.
  Status append_points(std::span<const glm::dvec3> points) {
    const int decimals = export_decimals(options_.unit_m);
    const size_t piece_count = (points.size() + kPointsPerPiece - 1) / kPointsPerPiece;
    pieces_.resize(piece_count);
    shared_workers().at(Priority::Background).for_ranges(piece_count, 1, [&](size_t begin, size_t end) {
      for (size_t piece = begin; piece < end; ++piece) {
        const auto some = points.subspan(piece * kPointsPerPiece,
                                         std::min(kPointsPerPiece, points.size() - piece * kPointsPerPiece));
        std::string& text = pieces_[piece];
        text.resize(some.size() * kMostPointChars);
        char* out = text.data();
        for (const glm::dvec3& point : some) {
          *out++ = '(';
          for (int axis = 0; axis < 3; ++axis) {
            out = put_decimal(out, point[axis], decimals);
            *out++ = axis < 2 ? ',' : ')';
          }
          *out++ = ',';
        }
        text.resize(static_cast<size_t>(out - text.data()));
      }
    });
    if (!pieces_.empty()) pieces_.back().back() = ']';  // instead of the last comma
    RETURN_IF_ERROR(file_.append("["));
    for (const std::string& piece : pieces_) RETURN_IF_ERROR(file_.append(piece));
    return {};
  }

  const ExportOptions options_;
  const StrandSet& strands_;
  OutputFile file_;
  double half_width_ = 0.0;
  uint64_t end_time_at_ = 0;
  int64_t last_frame_ = 1;
  std::vector<std::string> pieces_;  // of points, kept for their memory
  std::vector<Pose> head_poses_;     // of all frames, where the head moves
  std::vector<Extent> extents_;      // of all frames: 48 bytes for each
};

}  // namespace

std::vector<std::pair<std::string, double>> usd_material(const StrandSet& strands) {
  const HairMaterial material = strands.material();
  std::vector<std::pair<std::string, double>> said;
  for (const auto& [name, value] : {std::pair("physics:youngsModulus", material.young_modulus),
                                    {"physics:poissonsRatio", material.poisson_ratio},
                                    {"physics:density", material.density}})
    if (value) said.emplace_back(name, *value);
  return said;
}

std::string usd_description(const ExportOptions& options, const StrandSet& strands) {
  return fmt::format(
      "{} strands of {} vertices, root first, in {}. Time code {} is the rest shape, the motion begins at "
      "{}.",
      strands.strand_count(), strands.vertex_count(),
      options.space == ExportSpace::Head ? "the head's own space" : "the world", options.first_number - 1,
      options.first_number);
}

Result<std::unique_ptr<StrandWriter>> make_usda_writer(const ExportOptions& options,
                                                       const StrandSet& strands) {
  ASSIGN_OR_RETURN(OutputFile file, OutputFile::create(options.path));
  auto writer = std::make_unique<UsdaWriter>(options, strands, std::move(file));
  RETURN_IF_ERROR(writer->begin());
  return std::unique_ptr<StrandWriter>(std::move(writer));
}

}  // namespace strandcast
