#include "common/groom/usd_loader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/groom/curve_basis.h"
#include "common/groom/text_scan.h"
#include "common/groom/usable_strands.h"
#include "common/groom/usd_stage.h"
#include "common/groom/usdc_coding.h"

namespace strandcast {
namespace {

constexpr std::string_view kZipMagic = "PK\x03\x04";

/// What notes say of all curves together.
struct Tally {
  size_t curves_prims = 0;
  size_t left_out_prims = 0;
  size_t cubic_strands = 0;
  size_t unfit_widths = 0;                // BasisCurves
  size_t moving_prims = 0;                // whose transform has time samples
  size_t rests = 0, rests_elsewhere = 0;  // BasisCurves with a rest shape
  std::string basis;
  std::optional<double> time_code;
  float least_width = 0.0f, most_width = 0.0f;
  std::vector<uint8_t> is_guide;  // of each strand
};

struct CurveKind {
  bool is_linear = true;
  CurveBasis basis = CurveBasis::Bezier;
  CurveEnds ends = CurveEnds::Open;
};

Result<CurveKind> kind_of(const UsdCurves& curves) {
  CurveKind kind;
  if (curves.wrap == "periodic")
    return make_error(ErrorCode::BadInput, "wrap is 'periodic': closed curves are no strands");
  if (curves.wrap != "nonperiodic" && curves.wrap != "pinned")
    return make_error(ErrorCode::BadInput, "wrap is {}, known are nonperiodic and pinned",
                      strandcast::quoted(curves.wrap));
  kind.ends = curves.wrap == "pinned" ? CurveEnds::Pinned : CurveEnds::Open;
  kind.is_linear = curves.type == "linear";
  if (kind.is_linear) return kind;
  if (curves.type != "cubic")
    return make_error(ErrorCode::BadInput, "type is {}, known are linear and cubic",
                      strandcast::quoted(curves.type));
  if (curves.basis == "bspline") {
    kind.basis = CurveBasis::BSpline;
  } else if (curves.basis == "catmullRom") {
    kind.basis = CurveBasis::CatmullRom;
  } else if (curves.basis != "bezier") {
    return make_error(ErrorCode::BadInput, "basis is {}, known are bezier, bspline and catmullRom",
                      strandcast::quoted(curves.basis));
  }
  return kind;
}

/// Checks counts, and makes points as many as they need.
Status check_counts(UsdCurves& curves, std::vector<std::string>& notes) {
  for (size_t curve = 0; curve < curves.vertex_counts.size(); ++curve)
    if (curves.vertex_counts[curve] > kMaxSourceVertexCount)
      return make_error(ErrorCode::LimitExceeded, "curve {} has {} vertices, at most {} are allowed", curve,
                        curves.vertex_counts[curve], kMaxSourceVertexCount);
  return fit_points(curves.points, curves.vertex_counts, "curveVertexCounts", notes);
}

constexpr double kMostLabel = std::numeric_limits<int32_t>::max();  // of an id or a group

/// Names of the strands' groups; none where the file has none that fit.
std::vector<std::string> group_names_of(const UsdCurves& curves) {
  if (curves.group_name_indices.empty()) return curves.group_names;
  std::vector<std::string> names;
  for (const double index : curves.group_name_indices) {
    if (!(index >= 0.0 && index < static_cast<double>(curves.group_names.size()))) return {};
    names.push_back(curves.group_names[static_cast<size_t>(index)]);
  }
  return names;
}

/// Labels of these strands; lists that fit nothing are lacking. `scale`: of widths. `own_name`: of strands
/// whose group has no name.
StrandLabels labels_of(const UsdCurves& curves, double scale, const std::string& own_name) {
  const size_t strands = curves.vertex_counts.size();
  StrandLabels labels;
  const auto whole_numbers = [strands](const std::vector<double>& from) {
    std::vector<int32_t> to;
    if (from.size() == strands)
      for (const double value : from)
        to.push_back(std::abs(value) <= kMostLabel ? static_cast<int32_t>(value) : 0);
    return to;
  };
  labels.id = whole_numbers(curves.ids);
  labels.group = whole_numbers(curves.groups);
  StrandNames names(group_names_of(curves), strands, own_name);
  labels.object = std::move(names.of_strand);
  labels.object_name = std::move(names.name);
  const size_t widths = curves.widths.size();
  const bool is_fit = (widths == 1 || widths == strands || widths == curves.points.size()) &&
                      std::all_of(curves.widths.begin(), curves.widths.end(),
                                  [](float width) { return width >= 0.0f && std::isfinite(width); });
  for (size_t strand = 0; is_fit && strand < strands; ++strand)
    for (uint32_t i = 0; i < curves.vertex_counts[strand]; ++i) {
      const size_t element = widths == 1 ? 0 : widths == strands ? strand : labels.width.size();
      labels.width.push_back(static_cast<float>(scale * static_cast<double>(curves.widths[element])));
    }
  return labels;
}

/// Where the rest shape of curve physics has the roots: where the points have them, or in a space of its own.
enum class RestShape { NotThere, InPlace, Elsewhere };

RestShape rest_shape_of(const UsdCurves& curves) {
  constexpr float kSameShare = 1e-3f;  // of the largest coordinate
  if (curves.rest_points.empty()) return RestShape::NotThere;
  if (curves.rest_points.size() != curves.points.size()) return RestShape::Elsewhere;
  float reach = 0.0f;
  for (const glm::vec3& point : curves.points)
    reach = std::max({reach, std::abs(point.x), std::abs(point.y), std::abs(point.z)});
  size_t root = 0;
  for (const uint32_t count : curves.vertex_counts) {
    if (count > 0 && !(glm::distance(curves.rest_points[root], curves.points[root]) <= kSameShare * reach))
      return RestShape::Elsewhere;
    root += count;
  }
  return RestShape::InPlace;
}

/// What the first material of curve physics says, and the curves themselves: in kg and the file's lengths.
HairMaterial material_of(const UsdStage& stage, std::vector<std::string>& notes) {
  HairMaterial material;
  size_t others = 0;
  const auto is_said = [](const std::optional<double>& value) { return value && std::isfinite(*value); };
  for (size_t prim = 0; prim < stage.prim.size(); ++prim) {
    const UsdPrim& own = stage.prim[prim];
    const bool says_stiffness = is_said(own.matter.young_modulus) || is_said(own.bend_modulus);
    if (is_left_out(stage, prim) || !(says_stiffness || is_said(own.matter.diameter))) continue;
    if (material.is_known()) {
      ++others;
      continue;
    }
    const auto said = [&](std::optional<double> value, double factor) {
      return is_said(value) ? std::optional(*value * factor) : std::nullopt;
    };
    material.diameter = said(own.matter.diameter, 1.0);
    material.young_modulus =
        said(is_said(own.matter.young_modulus) ? own.matter.young_modulus : own.bend_modulus,
             stage.kilograms_per_unit);
    material.poisson_ratio = said(own.matter.poisson_ratio, 1.0);
    // 0 stands for what is not said.
    if (own.matter.density.value_or(0.0) > 0.0)
      material.density = said(own.matter.density, stage.kilograms_per_unit);
  }
  for (const UsdPrim& prim : stage.prim)
    if (prim.curves && !prim.curves->thicknesses.empty() && !material.diameter) {
      const std::vector<double>& all = prim.curves->thicknesses;
      material.diameter = std::accumulate(all.begin(), all.end(), 0.0) / static_cast<double>(all.size());
    }
  if (others > 0) notes.push_back(fmt::format("{} further physics materials are not read", others));
  return material;
}

Status add_curves(UsdStage& stage, size_t prim, Groom& groom, StrandLabels& labels, Tally& tally) {
  UsdCurves& curves = *stage.prim[prim].curves;
  RETURN_IF_ERROR(check_counts(curves, stage.notes));
  if (groom.strand_count() + curves.vertex_counts.size() > kMaxStrandCount ||
      groom.rest_position_m.size() + curves.points.size() > kMaxGroomVertices)
    return make_error(ErrorCode::LimitExceeded, "more than {} strands or {} vertices", kMaxStrandCount,
                      kMaxGroomVertices);
  ASSIGN_OR_RETURN(const CurveKind kind, kind_of(curves));
  ASSIGN_OR_RETURN(const glm::dmat4 world, world_from_prim(stage, prim));
  const RestShape rest = rest_shape_of(curves);
  if (rest == RestShape::Elsewhere) ++tally.rests_elsewhere;
  if (rest == RestShape::InPlace) ++tally.rests;
  const std::span<const glm::vec3> points(rest == RestShape::InPlace ? curves.rest_points : curves.points);
  size_t first = 0;
  for (size_t curve = 0; curve < curves.vertex_counts.size(); ++curve) {
    const auto control = points.subspan(first, curves.vertex_counts[curve]);
    first += control.size();
    std::vector<glm::vec3> strand(control.begin(), control.end());
    if (!kind.is_linear && control.size() >= kMinVertexCount) {
      auto on_curve = points_on_curve(control, kind.basis, kind.ends);
      if (!on_curve) return at(fmt::format("curve {}", curve), on_curve.error());
      strand = std::move(on_curve).value();
      ++tally.cubic_strands;
      tally.basis = curves.basis;
    }
    for (const glm::vec3& point : strand) {
      groom.rest_position_m.emplace_back(world * glm::dvec4(point, 1.0));
    }
    groom.offset.push_back(static_cast<uint32_t>(groom.rest_position_m.size()));
  }
  const size_t strands = curves.vertex_counts.size();
  StrandLabels own =
      labels_of(curves, std::cbrt(std::abs(glm::determinant(glm::dmat3(world)))), stage.prim[prim].name);
  const bool has_widths = !own.width.empty();
  if (!has_widths && !curves.widths.empty()) ++tally.unfit_widths;
  pad_labels(own, strands, groom.rest_position_m.size() - groom.offset[groom.strand_count() - strands]);
  join_labels(labels, own);
  const auto is_finite_number = [](auto value) { return std::isfinite(value); };
  const bool has_uv = curves.root_uv.size() == 2 * strands &&
                      std::all_of(curves.root_uv.begin(), curves.root_uv.end(), is_finite_number);
  for (size_t i = 0; i < strands; ++i)
    groom.root_uv.push_back(has_uv ? glm::vec2(curves.root_uv[2 * i], curves.root_uv[2 * i + 1])
                                   : glm::vec2(NAN));
  const auto is_guide = [&](size_t strand) {
    const std::vector<double>& told = curves.guides;
    const bool fits = told.size() == strands || told.size() == 1;
    return purpose_of(stage, prim) == "guide" || (fits && told[told.size() == 1 ? 0 : strand] > 0.0);
  };
  for (size_t strand = 0; strand < strands; ++strand) tally.is_guide.push_back(is_guide(strand) ? 1 : 0);
  ++tally.curves_prims;
  if (curves.time_code) tally.time_code = curves.time_code;
  if (is_moving(stage, prim)) ++tally.moving_prims;
  for (const float width : has_widths ? curves.widths : std::vector<float>()) {
    tally.least_width = tally.most_width == 0.0f ? width : std::min(tally.least_width, width);
    tally.most_width = std::max(tally.most_width, width);
  }
  return {};
}

/// What to say of instancers; empty where there are none.
std::string left_out_instancers(const UsdStage& stage) {
  uint64_t instancers = 0, instances = 0;
  for (const UsdPrim& prim : stage.prim) {
    if (!prim.is_instancer) continue;
    ++instancers;
    instances += prim.instance_count;
  }
  if (instancers == 0) return {};
  return fmt::format("{} with {} left out: make the instances curves of their own, and export anew",
                     counted(instancers, "PointInstancer", "PointInstancers"),
                     counted(instances, "instance is", "instances are"));
}

std::string where_else(const UsdStage& stage) {
  if (const std::string instancers = left_out_instancers(stage); !instancers.empty())
    return "; " + instancers;
  if (stage.reference_count > 0)
    return "; it refers to other files, prims or variants, which are not followed: flatten it first "
           "(usdcat --flatten)";
  if (stage.other_curve_count > 0) return "; NurbsCurves and HermiteCurves are not read";
  return "";
}

std::vector<std::string> notes_of(const UsdStage& stage, const Tally& tally) {
  std::vector<std::string> notes = stage.notes;
  if (tally.curves_prims > 1) notes.push_back(fmt::format("strands of {} BasisCurves", tally.curves_prims));
  if (tally.time_code)
    notes.push_back(
        fmt::format("strands as at time code {}, the first of their time samples", *tally.time_code));
  if (tally.moving_prims > 0)
    notes.push_back(counted(tally.moving_prims, "BasisCurves stands as its", "BasisCurves stand as their") +
                    " first transform has it: that motion is not taken over");
  if (tally.unfit_widths > 0)
    notes.push_back(fmt::format("widths of {} BasisCurves are negative or fit nothing", tally.unfit_widths));
  if (tally.cubic_strands > 0)
    notes.push_back(
        fmt::format("{} ({}) became as many points on each curve as it has control points; "
                    "groom.file.vertex_count asks for others",
                    counted(tally.cubic_strands, "cubic curve", "cubic curves"), tally.basis));
  if (tally.most_width > 0.0f)
    notes.push_back(
        fmt::format("widths of {:.4g} to {:.4g} units are kept for exports: look.strand_radius_m says "
                    "how thick hair is drawn",
                    tally.least_width, tally.most_width));
  if (tally.rests > 0) notes.emplace_back("the hair is the rest shape of its curve physics");
  if (tally.rests_elsewhere > 0)
    notes.emplace_back("rest shapes whose roots lie elsewhere are not read: points are the hair");
  if (tally.left_out_prims > 0)
    notes.push_back(counted(tally.left_out_prims, "BasisCurves is", "BasisCurves are") +
                    " left out: inactive, invisible, a proxy, a class, an override or of an instancer");
  add_note(notes, left_out_instancers(stage));
  if (stage.reference_count > 0)
    notes.push_back(counted(stage.reference_count, "reference, layer or variant is",
                            "references, layers or variants are") +
                    " not followed");
  if (stage.other_curve_count > 0)
    notes.push_back(counted(stage.other_curve_count, "NurbsCurves or HermiteCurves is",
                            "NurbsCurves or HermiteCurves are") +
                    " not read");
  return notes;
}

/// What begins a member of a package: the parts of ZIP's local file header that are needed.
struct Member {
  static constexpr uint64_t kHeaderBytes = 30;
  std::string name;
  uint64_t begin = 0, size_bytes = 0;  // of what it holds
};

Result<Member> read_member(GroomSource& source, uint64_t offset) {
  constexpr uint64_t kFlagsAt = 6, kMethodAt = 8, kSizeAt = 18, kNameSizeAt = 26, kExtraSizeAt = 28;
  constexpr uint16_t kUnknownFlags = 1u | 1u << 3;  // encrypted, or sizes come later
  ASSIGN_OR_RETURN(const auto magic, source.array<char>(offset, kZipMagic.size()));
  if (std::string_view(magic.data(), magic.size()) != kZipMagic)
    return make_error(ErrorCode::BadInput, "the package holds no .usd, .usda or .usdc");
  ASSIGN_OR_RETURN(const auto flags, source.number<uint16_t>(offset + kFlagsAt));
  ASSIGN_OR_RETURN(const auto method, source.number<uint16_t>(offset + kMethodAt));
  ASSIGN_OR_RETURN(const auto size_bytes, source.number<uint32_t>(offset + kSizeAt));
  ASSIGN_OR_RETURN(const auto name_size, source.number<uint16_t>(offset + kNameSizeAt));
  ASSIGN_OR_RETURN(const auto extra_size, source.number<uint16_t>(offset + kExtraSizeAt));
  ASSIGN_OR_RETURN(const auto name, source.array<char>(offset + Member::kHeaderBytes, name_size));
  Member member{
      {name.begin(), name.end()}, offset + Member::kHeaderBytes + name_size + extra_size, size_bytes};
  if (method != 0 || (flags & kUnknownFlags) != 0)
    return make_error(ErrorCode::Unsupported,
                      "{} in the package is not stored as it is: pack it anew as .usdz",
                      strandcast::quoted(member.name));
  if (!source.has(member.begin, member.size_bytes, 1))
    return make_error(
        ErrorCode::BadInput,
        "{} in the package is cut off: it should have {} bytes, copy it again or export it anew",
        strandcast::quoted(member.name), member.size_bytes);
  return member;
}

/// Leaves of a package its first layer.
Status open_package(GroomSource& source) {
  constexpr int kMostMembers = 1'000;
  uint64_t offset = 0;
  for (int i = 0; i < kMostMembers; ++i) {
    ASSIGN_OR_RETURN(const Member member, read_member(source, offset));
    if (is_usd_extension(std::filesystem::path(member.name).extension().string())) {
      source.narrow(member.begin, member.size_bytes);
      return {};
    }
    offset = member.begin + member.size_bytes;
  }
  return make_error(ErrorCode::LimitExceeded, "no .usd, .usda or .usdc is among the first {} of the package",
                    kMostMembers);
}

Result<std::string> beginning_of(GroomSource& source) {
  constexpr uint64_t kLookedAtBytes = 8;
  ASSIGN_OR_RETURN(const auto bytes, source.array<char>(0, std::min(kLookedAtBytes, source.size_bytes())));
  return std::string(bytes.begin(), bytes.end());
}

Result<UsdStage> read_stage(const std::shared_ptr<GroomSource>& source) {
  ASSIGN_OR_RETURN(std::string beginning, beginning_of(*source));
  if (beginning.starts_with(kZipMagic)) {
    RETURN_IF_ERROR(open_package(*source));
    ASSIGN_OR_RETURN(beginning, beginning_of(*source));
  }
  if (beginning == kUsdcMagic) return read_usdc_stage(source);
  ASSIGN_OR_RETURN(const auto text, source->array<char>(0, source->size_bytes()));
  return read_usda_stage({text.data(), text.size()});
}

Result<StatedGroom> read(const std::shared_ptr<GroomSource>& source, GuideUse guides) {
  ASSIGN_OR_RETURN(UsdStage stage, read_stage(source));
  StatedGroom stated;
  stated.groom.offset.push_back(0);
  Tally tally;
  for (size_t prim = 0; prim < stage.prim.size(); ++prim) {
    if (!stage.prim[prim].curves) continue;
    if (is_left_out(stage, prim)) {
      ++tally.left_out_prims;
      continue;
    }
    const Status added = add_curves(stage, prim, stated.groom, stated.labels, tally);
    if (!added) return at(fmt::format("prim {}", strandcast::quoted(stage.prim[prim].name)), added.error());
  }
  if (stated.groom.strand_count() == 0)
    return make_error(ErrorCode::BadInput, "there are no BasisCurves to read{}", where_else(stage));
  if (stage.meters_per_unit) stated.unit_m = static_cast<float>(*stage.meters_per_unit);
  stated.is_z_up = stage.is_z_up;
  stated.unit_reason = "its metersPerUnit says so";
  stated.up_axis_reason = "its upAxis says so";
  stated.notes = notes_of(stage, tally);
  stated.material = material_of(stage, stated.notes);
  add_note(stated.notes, part_guides(stated.groom, stated.labels, std::move(tally.is_guide), guides));
  add_note(stated.notes, fill_lacking(stated.groom, stated.labels));
  stated.groom = with_pinning(std::move(stated.groom), Pinning::Root);
  return with_usable_strands(std::move(stated));
}

}  // namespace

bool is_usd_extension(std::string_view extension) {
  return extension == ".usd" || extension == ".usda" || extension == ".usdc" || extension == ".usdz";
}

Result<StatedGroom> read_usd(std::string_view file, GuideUse guides) {
  return read(std::make_shared<GroomSource>(std::as_bytes(std::span(file))), guides);
}

Result<StatedGroom> load_usd(const std::filesystem::path& path, GuideUse guides) {
  auto source = GroomSource::open(path);
  if (!source) return at(path.string(), source.error());
  auto stated = read(*source, guides);
  if (!stated) return at(path.string(), stated.error());
  stated->groom.name = path.stem().string();
  return stated;
}

}  // namespace strandcast
