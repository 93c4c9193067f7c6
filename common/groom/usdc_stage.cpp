// The stage of a binary USD file.
#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "common/groom/text_scan.h"
#include "common/groom/usd_loader.h"
#include "common/groom/usd_stage.h"
#include "common/groom/usdc_archive.h"

namespace strandcast {
namespace {

class CrateReader {
 public:
  explicit CrateReader(UsdcArchive archive) : archive_(std::move(archive)) {}

  Result<UsdStage> read() {
    RETURN_IF_ERROR(sort_specs());
    RETURN_IF_ERROR(read_layer());
    RETURN_IF_ERROR(open_children(archive_.root(), std::nullopt, 0));
    while (!open_.empty()) {
      const Open next = open_.back();
      open_.pop_back();
      RETURN_IF_ERROR(read_prim(next));
    }
    return std::move(stage_);
  }

 private:
  /// A prim that is still to be read.
  struct Open {
    uint32_t spec;
    std::optional<size_t> parent;
    size_t depth;
  };
  struct Attribute {
    uint32_t prim;  // path
    uint32_t spec;
  };

  static uint64_t key_of(uint32_t parent, int32_t token) {
    return uint64_t{parent} << 32 | static_cast<uint32_t>(token);
  }
  const UsdcSpec& spec(uint32_t index) const { return archive_.specs()[index]; }
  const UsdcPath& path_of(const UsdcSpec& spec) const { return archive_.paths()[spec.path]; }

  Status sort_specs() {
    for (uint32_t i = 0; i < archive_.specs().size(); ++i) {
      const UsdcPath& path = path_of(spec(i));
      if (spec(i).kind == UsdcKind::Attribute) attributes_.push_back({path.parent, i});
      if (spec(i).kind != UsdcKind::Prim) continue;
      if (prims_.size() == kMaxUsdPrims)
        return make_error(ErrorCode::LimitExceeded, "more than {} prims", kMaxUsdPrims);
      prims_[key_of(path.parent, path.token)] = i;
    }
    std::stable_sort(attributes_.begin(), attributes_.end(),
                     [](const Attribute& a, const Attribute& b) { return a.prim < b.prim; });
    return {};
  }

  Status read_layer() {
    ASSIGN_OR_RETURN(const auto axis, archive_.field(archive_.root(), "upAxis"));
    if (axis) {
      ASSIGN_OR_RETURN(const auto text, archive_.text(*axis));
      set_up_axis(stage_, text);
    }
    ASSIGN_OR_RETURN(const auto unit, archive_.field(archive_.root(), "metersPerUnit"));
    if (unit) {
      ASSIGN_OR_RETURN(const auto numbers, archive_.numbers(*unit));
      set_meters_per_unit(stage_, numbers.empty() ? 0.0 : numbers.front());
    }
    ASSIGN_OR_RETURN(const auto mass, archive_.field(archive_.root(), "kilogramsPerUnit"));
    if (mass) {
      ASSIGN_OR_RETURN(const auto numbers, archive_.numbers(*mass));
      if (!numbers.empty()) stage_.kilograms_per_unit = numbers.front();
    }
    return count_references(archive_.root());
  }

  /// Counts what would bring prims from elsewhere.
  Status count_references(const UsdcSpec& spec) {
    for (const char* const name : {"subLayers", "references", "payload", "inheritPaths", "specializes"}) {
      ASSIGN_OR_RETURN(const auto value, archive_.field(spec, name));
      if (value) ++stage_.reference_count;
    }
    ASSIGN_OR_RETURN(const auto sets, archive_.field(spec, "variantSetChildren"));
    if (!sets) return {};
    ASSIGN_OR_RETURN(const auto names, archive_.texts(*sets, kMaxUsdPrims));
    stage_.reference_count += names.size();
    return {};
  }

  /// Keeps the prims in another one to be read next, in their order.
  Status open_children(const UsdcSpec& parent, std::optional<size_t> index, size_t depth) {
    ASSIGN_OR_RETURN(const auto children, archive_.field(parent, "primChildren"));
    if (!children) return {};
    ASSIGN_OR_RETURN(const auto names, archive_.texts(*children, kMaxUsdPrims));
    if (depth == kMaxUsdDepth && !names.empty())
      return make_error(ErrorCode::LimitExceeded, "prims in each other, more than {}", kMaxUsdDepth);
    for (size_t i = names.size(); i > 0; --i) {
      const auto found = prims_.find(key_of(parent.path, names[i - 1]));
      if (found == prims_.end())
        return make_error(ErrorCode::BadInput, "a prim {} is named that is not there, or twice",
                          quoted(archive_.token(names[i - 1])));
      open_.push_back({found->second, index, depth + 1});
      prims_.erase(found);
    }
    return {};
  }

  Status read_prim(const Open& open) {
    const UsdcSpec& own = spec(open.spec);
    const size_t index = stage_.prim.size();
    UsdPrim prim;
    prim.parent = open.parent;
    prim.name = one_line(archive_.token(path_of(own).token), kMaxUsdNameChars);
    const std::string place = fmt::format("prim {}", strandcast::quoted(prim.name));
    if (const Status known = read_kind(own, prim); !known) return at(place, known.error());
    const auto [begin, end] =
        std::equal_range(attributes_.begin(), attributes_.end(), Attribute{own.path, 0},
                         [](const Attribute& a, const Attribute& b) { return a.prim < b.prim; });
    for (auto attribute = begin; attribute != end; ++attribute) {
      const std::string_view name = archive_.token(path_of(spec(attribute->spec)).token);
      const Status taken = take(name, spec(attribute->spec), prim);
      if (!taken) return at(fmt::format("{}, {}", place, one_line(name, kMaxUsdNameChars)), taken.error());
    }
    stage_.prim.push_back(std::move(prim));
    const Status opened = open_children(own, index, open.depth);
    return opened ? opened : Status(at(place, opened.error()));
  }

  Status read_kind(const UsdcSpec& own, UsdPrim& prim) {
    ASSIGN_OR_RETURN(const auto specifier, archive_.field(own, "specifier"));
    ASSIGN_OR_RETURN(const auto active, archive_.field(own, "active"));
    // 0 is "def".
    prim.is_left_out = !specifier || specifier->type() != UsdcType::Specifier || specifier->payload() != 0 ||
                       (active && active->type() == UsdcType::Bool && active->payload() == 0);
    ASSIGN_OR_RETURN(const auto type, archive_.field(own, "typeName"));
    if (type) {
      ASSIGN_OR_RETURN(const auto name, archive_.text(*type));
      if (name == "BasisCurves") prim.curves.emplace();
      prim.is_material = name == "Material";
      prim.is_instancer = name == kUsdInstancer;
      if (is_other_curves(name)) ++stage_.other_curve_count;
    }
    return count_references(own);
  }

  static bool is_wanted(std::string_view name, UsdPrim& prim) {
    if (name == "visibility" || name == "purpose" || name.starts_with("xformOp")) return true;
    if (find_material_number(prim, name) != nullptr || (prim.is_instancer && name == kUsdInstances))
      return true;
    return prim.curves &&
           (name == "points" || name == kUsdRestPoints || name == "curveVertexCounts" || name == "widths" ||
            name == kUsdGroupName || find_curves_numbers(*prim.curves, name) != nullptr ||
            find_curves_word(*prim.curves, name) != nullptr);
  }

  /// Takes the value of a property: what has no time goes before the first of its samples.
  Status take(std::string_view name, const UsdcSpec& own, UsdPrim& prim) {
    if (!is_wanted(name, prim)) return {};
    ASSIGN_OR_RETURN(const auto still, archive_.field(own, "default"));
    const bool has_still = still && still->type() != UsdcType::ValueBlock &&
                           !(still->is(UsdcValue::kArray) && still->payload() == 0);
    if (has_still) RETURN_IF_ERROR(take_value(name, *still, std::nullopt, prim));
    if (has_still && name != "visibility") return {};
    ASSIGN_OR_RETURN(const auto samples, archive_.field(own, "timeSamples"));
    if (!samples) return {};
    ASSIGN_OR_RETURN(const auto first, archive_.sample(*samples, 0));
    if (!first) return {};
    if (!std::isfinite(first->time)) return make_error(ErrorCode::BadInput, "{} is no time", first->time);
    return take_value(name, first->value, first->time, prim);
  }

  Status take_value(std::string_view name, UsdcValue value, std::optional<double> time, UsdPrim& prim) {
    if (name == "visibility") {
      ASSIGN_OR_RETURN(const auto text, archive_.text(value));
      prim.is_left_out = prim.is_left_out || text == "invisible";
      return {};
    }
    if (name == "purpose") {
      ASSIGN_OR_RETURN(const auto text, archive_.text(value));
      prim.purpose = one_line(text, kMaxUsdWordChars);
      return {};
    }
    if (name == "xformOpOrder") {
      ASSIGN_OR_RETURN(const auto order, archive_.texts(value, kMaxUsdXformOps));
      prim.op_order.clear();
      for (const int32_t step : order) prim.op_order.emplace_back(archive_.token(step));
      return {};
    }
    if (name.starts_with("xformOp")) {
      ASSIGN_OR_RETURN(auto numbers, archive_.numbers(value));
      return set_xform_op(prim, name, std::move(numbers), time.has_value());
    }
    if (name == kUsdInstances) {
      ASSIGN_OR_RETURN(const auto instances, archive_.ints(value, kMaxGroomVertices));
      prim.instance_count = instances.size();
      return {};
    }
    if (std::optional<double>* const number = find_material_number(prim, name)) {
      ASSIGN_OR_RETURN(const auto numbers, archive_.numbers(value));
      if (!numbers.empty()) *number = numbers.front();
      return {};
    }
    return take_curves(name, value, time, *prim.curves);
  }

  Status take_curves(std::string_view name, UsdcValue value, std::optional<double> time, UsdCurves& curves) {
    if (name == "points") {
      ASSIGN_OR_RETURN(curves.points, archive_.points(value, kMaxGroomVertices));
      curves.time_code = time;
      return {};
    }
    if (name == kUsdRestPoints) {
      ASSIGN_OR_RETURN(curves.rest_points, archive_.points(value, kMaxGroomVertices));
      return {};
    }
    if (name == "curveVertexCounts") {
      ASSIGN_OR_RETURN(const auto counts, archive_.ints(value, kMaxStrandCount));
      for (const int32_t count : counts)
        if (count < 0) return make_error(ErrorCode::BadInput, "{} is no number of vertices", count);
      curves.vertex_counts.assign(counts.begin(), counts.end());
      return {};
    }
    if (name == "widths") {
      ASSIGN_OR_RETURN(curves.widths, archive_.floats(value, kMaxGroomVertices));
      return {};
    }
    if (std::vector<double>* const numbers = find_curves_numbers(curves, name)) {
      ASSIGN_OR_RETURN(*numbers, archive_.list(value, kMaxStrandCount));
      return {};
    }
    if (name == kUsdGroupName && value.is(UsdcValue::kArray)) {
      ASSIGN_OR_RETURN(const auto tokens, archive_.texts(value, kMaxStrandCount));
      for (const int32_t token : tokens)
        curves.group_names.push_back(one_line(archive_.token(token), kMaxGroupNameChars));
      return {};
    }
    ASSIGN_OR_RETURN(const auto text, archive_.text(value));
    if (name == kUsdGroupName) {
      curves.group_names = {one_line(text, kMaxGroupNameChars)};
      return {};
    }
    *find_curves_word(curves, name) = one_line(text, kMaxUsdWordChars);
    return {};
  }

  const UsdcArchive archive_;
  UsdStage stage_;
  std::unordered_map<uint64_t, uint32_t> prims_;  // specs, by key_of(); without those that were read
  std::vector<Attribute> attributes_;             // by their prims
  std::vector<Open> open_;                        // the next one last
};

}  // namespace

Result<UsdStage> read_usdc_stage(std::shared_ptr<GroomSource> source) {
  ASSIGN_OR_RETURN(UsdcArchive archive, UsdcArchive::read(std::move(source)));
  return CrateReader(std::move(archive)).read();
}

}  // namespace strandcast
