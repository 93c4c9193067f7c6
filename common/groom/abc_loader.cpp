#include "common/groom/abc_loader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <utility>

#include "common/groom/abc_curves.h"
#include "common/groom/abc_tree.h"
#include "common/groom/curve_basis.h"
#include "common/groom/text_scan.h"
#include "common/groom/usable_strands.h"

namespace strandcast {
namespace {

constexpr std::array<const char*, 6> kBasisNames = {"none",       "bezier",  "bspline",
                                                    "catmullRom", "hermite", "power"};
constexpr size_t kCubicOrder = 4;

/// What notes say of all curves together.
struct AbcTally {
  size_t objects = 0, double_objects = 0, instances = 0;
  size_t moving_objects = 0;  // by a transform
  size_t hidden_objects = 0, closed_objects = 0, unknown_objects = 0, unfit_widths = 0, unfit_roots = 0;
  BadItems empty_strands;
  uint64_t read_strands = 0;
  size_t cubic_strands = 0;
  std::string basis;
  double time_s = 0.0;
  uint64_t most_samples = 0;
  double least_width = 0.0, most_width = 0.0;
  std::set<double> groups;
  bool has_ids = false;
};

/// Knots, orders and weights of splines, taken strand by strand.
struct Splines {
  std::vector<double> knots, weights, orders;
  size_t next_knot = 0;
};

std::vector<double> numbers_of(const std::optional<AbcParam>& param) {
  std::vector<double> numbers;
  for (size_t i = 0; param && i < param->count(); ++i) numbers.push_back(param->number(i));
  return numbers;
}

Result<Splines> read_splines(const AbcCurvesReader& reader, const AbcCurves& curves) {
  Splines splines;
  if (curves.is_on_strand()) return splines;
  ASSIGN_OR_RETURN(const auto knots, reader.param(".knots", 0));
  ASSIGN_OR_RETURN(const auto weights, reader.param("w", 0));
  ASSIGN_OR_RETURN(const auto orders, reader.param(".orders", 0));
  splines = {numbers_of(knots), numbers_of(weights), numbers_of(orders), 0};
  if (curves.type == AbcCurveType::VariableOrder && splines.orders.size() != curves.vertex_counts.size())
    return make_error(ErrorCode::BadInput, "{} orders for {} strands", splines.orders.size(),
                      curves.vertex_counts.size());
  if (splines.weights.size() != curves.points.size()) splines.weights.clear();
  return splines;
}

/// Knots of a spline that begins at its first point and ends at the last.
std::vector<double> even_knots(size_t point_count, size_t order) {
  std::vector<double> knots;
  for (size_t i = 0; i < point_count + order; ++i)
    knots.push_back(static_cast<double>(std::clamp(i, order - 1, point_count)));
  return knots;
}

/// A group or an id; 0 for what is none.
int32_t whole_number(double value) {
  constexpr double kMost = std::numeric_limits<int32_t>::max();
  return std::abs(value) <= kMost ? static_cast<int32_t>(value) : 0;
}

std::optional<size_t> element_of(AbcScope scope, const AbcCurves& curves, size_t strand,
                                 size_t first_vertex) {
  switch (scope) {
    case AbcScope::Constant:
      return 0;
    case AbcScope::Strand:
      return strand;
    case AbcScope::Vertex:
      return first_vertex;
    case AbcScope::Varying:
      break;
  }
  return curves.is_on_strand() ? std::optional(first_vertex) : std::nullopt;
}

class AbcLoading {
 public:
  AbcLoading(const AbcArchive& archive, GuideUse guides) : archive_(archive), guide_use_(guides) {
    groom_.offset.push_back(0);
  }

  Status run() {
    ASSIGN_OR_RETURN(const AbcTree tree, AbcTree::read(archive_));
    lost_instances_ = tree.lost_instance_count();
    for (size_t node = 0; node < tree.nodes().size(); ++node) {
      if (tree.nodes()[node].is_instance) ++tally_.instances;
      if (tree.nodes()[node].kind != AbcKind::Curves) continue;
      if (const Status added = add_object(tree, node); !added) return at(tree.path(node), added.error());
    }
    RETURN_IF_ERROR(settle_empty(tally_.empty_strands, tally_.read_strands, notes_));
    guide_note_ = part_guides(groom_, labels_, std::move(is_guide_), guide_use_, " (groom_guide)");
    lack_note_ = fill_lacking(groom_, labels_);
    if (groom_.strand_count() > 0) return {};
    return make_error(ErrorCode::BadInput, "there are no curves with strands to read{}",
                      tally_.hidden_objects + tally_.closed_objects + tally_.unknown_objects > 0
                          ? ": those that are there are hidden, closed or of a kind that is not read"
                          : "");
  }

  StatedGroom finish() {
    StatedGroom stated;
    const auto unit_m = parse_number<float>(abc_metadata_value(archive_.metadata(), "unit_m"));
    constexpr float kMostM = 1e3f;
    if (unit_m && *unit_m > 0.0f && *unit_m <= kMostM) stated.unit_m = unit_m;
    const std::string_view up = abc_metadata_value(archive_.metadata(), "up_axis");
    if (up == "Y" || up == "Z") stated.is_z_up = up == "Z";
    stated.unit_reason = stated.up_axis_reason = "its description says so";
    stated.notes = notes();
    stated.groom = with_pinning(std::move(groom_), Pinning::Root);
    stated.labels = std::move(labels_);
    return stated;
  }

 private:
  Status add_object(const AbcTree& tree, size_t node) {
    if (!tree.nodes()[node].is_visible) {
      ++tally_.hidden_objects;
      return {};
    }
    ASSIGN_OR_RETURN(const AbcCurvesReader reader,
                     AbcCurvesReader::open(archive_, tree.nodes()[node].object));
    ASSIGN_OR_RETURN(const AbcCurves curves, reader.read(0, kMaxStrandCount - groom_.strand_count(),
                                                         kMaxGroomVertices - groom_.rest_position_m.size()));
    for (const std::string& note : curves.notes)
      notes_.push_back(fmt::format("{}: {}", tree.path(node), note));
    if (curves.points.empty()) return {};
    if (curves.is_periodic) {
      ++tally_.closed_objects;
      return {};
    }
    const bool has_basis = curves.basis >= AbcBasis::Bezier && curves.basis <= AbcBasis::CatmullRom;
    if (curves.type == AbcCurveType::Cubic && !has_basis) {
      ++tally_.unknown_objects;
      return {};
    }
    ++tally_.objects;
    if (curves.is_double) ++tally_.double_objects;
    if (!tree.nodes()[node].world_from_node) ++tally_.moving_objects;
    if (reader.sample_count() > tally_.most_samples) {
      tally_.most_samples = reader.sample_count();
      tally_.time_s = reader.time_s(0);
    }
    ASSIGN_OR_RETURN(const glm::dmat4 world, tree.world_from_node(archive_, node, reader.time_s(0)));
    return add_strands(reader, curves, world, tree.nodes()[node].object.name);
  }

  /// `own_name` names strands whose group has no name.
  Status add_strands(const AbcCurvesReader& reader, const AbcCurves& curves, const glm::dmat4& world,
                     const std::string& own_name) {
    ASSIGN_OR_RETURN(const auto guide, strand_param(reader, curves, "groom_guide"));
    ASSIGN_OR_RETURN(const auto group, strand_param(reader, curves, "groom_group_id"));
    ASSIGN_OR_RETURN(const auto id, strand_param(reader, curves, "groom_id"));
    ASSIGN_OR_RETURN(const auto group_name, reader.texts("groom_group_name", 0));
    const StrandNames names(group_name, curves.vertex_counts.size(), own_name);
    const auto first_object = static_cast<uint32_t>(labels_.object_name.size());
    labels_.object_name.insert(labels_.object_name.end(), names.name.begin(), names.name.end());
    ASSIGN_OR_RETURN(const auto uv, root_uv(reader, curves));
    ASSIGN_OR_RETURN(const auto width, width_of(reader, curves));
    RETURN_IF_ERROR(count_widths(reader, width));
    const double scale = std::cbrt(std::abs(glm::determinant(glm::dmat3(world))));
    ASSIGN_OR_RETURN(Splines splines, read_splines(reader, curves));
    // One large object is not grown step by step; many small ones are.
    const size_t known = groom_.rest_position_m.size();
    if (curves.points.size() > known) groom_.rest_position_m.reserve(known + curves.points.size());
    tally_.read_strands += curves.vertex_counts.size();
    tally_.has_ids = tally_.has_ids || id.has_value();
    size_t first = 0;
    for (size_t strand = 0; strand < curves.vertex_counts.size(); ++strand) {
      const size_t count = curves.vertex_counts[strand];
      const size_t begin = std::exchange(first, first + count);
      auto points = points_of(curves, splines, strand, begin);
      if (!points) return at(fmt::format("strand {}", strand), points.error());
      if (count < kMinVertexCount) {
        tally_.empty_strands.add(at(own_name, empty_strand(strand)));
        continue;
      }
      if (count > kMaxSourceVertexCount)
        return make_error(ErrorCode::LimitExceeded, "strand {} has {} vertices, at most {} are allowed",
                          strand, count, kMaxSourceVertexCount);
      for (const glm::vec3& point : *points)
        groom_.rest_position_m.emplace_back(world * glm::dvec4(point, 1.0));
      groom_.offset.push_back(static_cast<uint32_t>(groom_.rest_position_m.size()));
      const auto value_of = [&](const std::optional<StrandParam>& param, uint32_t axis) {
        const auto element = element_of(param->scope, curves, strand, begin);
        return param->param.number(*element, axis);
      };
      is_guide_.push_back(guide && value_of(guide, 0) > 0.0 ? 1 : 0);
      constexpr size_t kMostGroups = 1'000;  // that are told apart
      const double group_id = group ? value_of(group, 0) : NAN;
      if (std::isfinite(group_id) && tally_.groups.size() < kMostGroups) tally_.groups.insert(group_id);
      labels_.group.push_back(std::isfinite(group_id) ? whole_number(group_id) : kNoLabel);
      labels_.id.push_back(id ? whole_number(value_of(id, 0)) : kNoLabel);
      labels_.object.push_back(first_object + names.of_strand[strand]);
      for (size_t i = 0; i < count; ++i) {
        const auto element = width ? element_of(width->scope, curves, strand, begin + i) : std::nullopt;
        labels_.width.push_back(element ? static_cast<float>(scale * width->param.number(*element)) : NAN);
      }
      groom_.root_uv.emplace_back(uv ? glm::vec2(value_of(uv, 0), value_of(uv, 1)) : glm::vec2(NAN));
    }
    return {};
  }

  struct StrandParam {
    AbcParam param;
    AbcScope scope;
  };

  /// A parameter with a value for each strand, or one for all of them or for each root.
  static Result<std::optional<StrandParam>> strand_param(const AbcCurvesReader& reader,
                                                         const AbcCurves& curves, std::string_view name,
                                                         uint32_t least_extent = 1) {
    ASSIGN_OR_RETURN(auto param, reader.param(name, 0));
    if (!param || param->values.extent < least_extent) return std::optional<StrandParam>();
    const std::optional<AbcScope> scope = curves.scope_of(*param);
    if (!scope || !element_of(*scope, curves, 0, 0)) return std::optional<StrandParam>();
    return std::optional(StrandParam{std::move(*param), *scope});
  }

  /// Unreal's own name, or the curves' coordinates: these may be a scalp's, or run along each strand.
  Result<std::optional<StrandParam>> root_uv(const AbcCurvesReader& reader, const AbcCurves& curves) {
    for (const char* const name : {"groom_root_uv", "uv"}) {
      ASSIGN_OR_RETURN(auto found, strand_param(reader, curves, name, 2));
      const bool is_for_each =
          found && (found->scope != AbcScope::Constant || curves.vertex_counts.size() == 1);
      if (!is_for_each) continue;
      bool is_finite = true;
      for (size_t i = 0; i < found->param.count(); ++i) {
        const glm::vec2 uv(found->param.number(i, 0), found->param.number(i, 1));
        is_finite = is_finite && std::isfinite(uv.x + uv.y);
      }
      if (is_finite) return found;
      ++tally_.unfit_roots;
    }
    return std::optional<StrandParam>();
  }

  /// Diameters, negative ones never; empty if there are none that fit.
  static Result<std::optional<StrandParam>> width_of(const AbcCurvesReader& reader, const AbcCurves& curves) {
    for (const char* const name : {"groom_width", "width"}) {
      ASSIGN_OR_RETURN(auto width, reader.param(name, 0));
      if (!width || width->count() == 0) continue;
      const std::optional<AbcScope> scope = curves.scope_of(*width);
      bool is_fit = scope.has_value();
      for (size_t i = 0; i < width->count(); ++i)
        is_fit = is_fit && width->number(i) >= 0.0 && std::isfinite(width->number(i));
      return is_fit ? std::optional(StrandParam{std::move(*width), *scope}) : std::nullopt;
    }
    return std::optional<StrandParam>();
  }

  Status count_widths(const AbcCurvesReader& reader, const std::optional<StrandParam>& width) {
    if (!width) {
      ASSIGN_OR_RETURN(const auto named, reader.param("groom_width", 0));
      ASSIGN_OR_RETURN(const auto plain, reader.param("width", 0));
      if ((named && named->count() > 0) || (plain && plain->count() > 0)) ++tally_.unfit_widths;
      return {};
    }
    double least = width->param.number(0), most = least;
    for (size_t i = 0; i < width->param.count(); ++i) {
      least = std::min(least, width->param.number(i));
      most = std::max(most, width->param.number(i));
    }
    tally_.least_width = tally_.most_width == 0.0 ? least : std::min(tally_.least_width, least);
    tally_.most_width = std::max(tally_.most_width, most);
    return {};
  }

  /// Points on a strand; also takes its knots.
  Result<std::vector<glm::vec3>> points_of(const AbcCurves& curves, Splines& splines, size_t strand,
                                           size_t begin) {
    const auto control = std::span(curves.points).subspan(begin, curves.vertex_counts[strand]);
    std::vector<glm::vec3> points(control.begin(), control.end());
    if (curves.is_on_strand()) return points;
    const bool is_variable = curves.type == AbcCurveType::VariableOrder;
    const double stated_order = is_variable ? splines.orders[strand] : static_cast<double>(kCubicOrder);
    if (!(stated_order >= 2.0 && stated_order <= static_cast<double>(kMaxCurveOrder)))
      return make_error(ErrorCode::BadInput, "its order is {}, allowed are 2 to {}", stated_order,
                        kMaxCurveOrder);
    const auto order = static_cast<size_t>(stated_order);
    const size_t knot_count = control.size() + order;
    const bool has_knots = splines.knots.size() - splines.next_knot >= knot_count;
    const auto knots =
        std::span<const double>(splines.knots).subspan(splines.next_knot, has_knots ? knot_count : 0);
    splines.next_knot += knots.size();
    if (control.size() < kMinVertexCount) return points;
    ++tally_.cubic_strands;
    tally_.basis = kBasisNames[static_cast<size_t>(curves.basis)];
    const bool is_spline = is_variable || curves.basis == AbcBasis::BSpline;
    if (!is_spline || (!is_variable && !has_knots)) {
      const CurveBasis basis = curves.basis == AbcBasis::Bezier    ? CurveBasis::Bezier
                               : curves.basis == AbcBasis::BSpline ? CurveBasis::BSpline
                                                                   : CurveBasis::CatmullRom;
      return points_on_curve(control, basis, CurveEnds::Open);
    }
    const std::vector<double> even =
        has_knots || control.size() < order ? std::vector<double>() : even_knots(control.size(), order);
    std::span<const double> weights;
    if (!splines.weights.empty()) weights = std::span(splines.weights).subspan(begin, control.size());
    return points_on_curve(
        KnotCurve{control, weights, has_knots ? knots : std::span<const double>(even), order});
  }

  std::vector<std::string> notes() const {
    std::vector<std::string> notes = notes_;
    const auto note = [&](size_t count, const std::string& sentence) {
      if (count > 0) notes.push_back(sentence);
    };
    const auto left_out = [](size_t count, const char* why) {
      return counted(count, "curves object is", "curves objects are") + " left out: " + why;
    };
    const AbcTally& t = tally_;
    note(t.objects > 1, fmt::format("strands of {} curves objects", t.objects));
    note(t.instances,
         counted(t.instances, "instance is hair of its", "instances are hair of their") + " own");
    note(lost_instances_, counted(lost_instances_, "instance is", "instances are") +
                              " left out: what they stand for is not there");
    note(t.most_samples > 1,
         fmt::format("strands as at {:.6g} s, the first of {} samples: motion of the file is not taken over",
                     t.time_s, t.most_samples));
    note(t.moving_objects,
         counted(t.moving_objects, "curves object stands as its", "curves objects stand as their") +
             " first transform has it: that motion is not taken over");
    note(t.double_objects, fmt::format("points of {} were in double precision and are rounded",
                                       counted(t.double_objects, "curves object", "curves objects")));
    note(t.cubic_strands, fmt::format("{} ({}) became as many points on each curve as it has control points; "
                                      "groom.file.vertex_count asks for others",
                                      counted(t.cubic_strands, "cubic curve", "cubic curves"), t.basis));
    note(t.most_width > 0.0, fmt::format("widths of {:.4g} to {:.4g} units are kept for exports: "
                                         "look.strand_radius_m says how thick hair is drawn",
                                         t.least_width, t.most_width));
    note(t.unfit_widths, fmt::format("widths of {} are negative or fit nothing",
                                     counted(t.unfit_widths, "curves object", "curves objects")));
    note(t.unfit_roots, fmt::format("root coordinates of {} are not finite",
                                    counted(t.unfit_roots, "curves object", "curves objects")));
    note(t.hidden_objects, left_out(t.hidden_objects, "what is hidden is no hair"));
    note(t.closed_objects, left_out(t.closed_objects, "closed curves are no strands"));
    note(t.unknown_objects,
         left_out(t.unknown_objects, "cubic curves without a basis, Hermite and power curves are not read"));
    add_note(notes, guide_note_);
    add_note(notes, lack_note_);
    note(t.groups.size() > 1,
         fmt::format("{} groups (groom_group_id) are one head of hair", t.groups.size()));
    note(t.has_ids,
         "ids (groom_id) change nothing here: strands stay in the file's order, and exports keep ids");
    return notes;
  }

  const AbcArchive& archive_;
  Groom groom_;
  std::vector<std::string> notes_;  // of single objects
  StrandLabels labels_;             // of all strands; NaN for widths that are not there
  std::vector<uint8_t> is_guide_;   // of each strand
  const GuideUse guide_use_;
  std::string guide_note_, lack_note_;
  size_t lost_instances_ = 0;
  AbcTally tally_;
};

Result<StatedGroom> load(Result<AbcContainer> container, GuideUse guides) {
  if (!container) return container.error();
  ASSIGN_OR_RETURN(const AbcArchive archive, AbcArchive::read(std::move(*container)));
  AbcLoading loading(archive, guides);
  RETURN_IF_ERROR(loading.run());
  return with_usable_strands(loading.finish());
}

}  // namespace

Result<StatedGroom> read_abc(std::span<const std::byte> file, GuideUse guides) {
  return load(AbcContainer::of(file), guides);
}

Result<StatedGroom> load_abc(const std::filesystem::path& path, GuideUse guides) {
  auto stated = load(AbcContainer::open(path), guides);
  if (!stated) return at(path.string(), stated.error());
  stated->groom.name = path.stem().string();
  return stated;
}

}  // namespace strandcast
