#include "common/groom/usd_stage.h"

#include <algorithm>

#include "common/base/mercy.h"
#include "common/groom/groom.h"
#include "common/groom/text_scan.h"
#include "common/groom/usd_loader.h"
#include "common/groom/usda_scan.h"

namespace strandcast {
namespace {

constexpr size_t kMatrixNumbers = 16;

class StageReader {
 public:
  explicit StageReader(std::string_view text) : scan_(text) {}

  /// Of a file that is cut off, what stands before that.
  Result<UsdStage> read() {
    const Status read = read_layer();
    if (scan_.decimal_commas() > 0)
      stage_.notes.push_back(counted(scan_.decimal_commas(), "number or point has decimal commas",
                                     "numbers and points have decimal commas"));
    if (read) return std::move(stage_);
    const bool has_strands = std::any_of(stage_.prim.begin(), stage_.prim.end(), [](const UsdPrim& prim) {
      return prim.curves && !prim.curves->points.empty();
    });
    if (!scan_.is_at_end() || !has_strands) return read.error();
    stage_.notes.push_back(
        fmt::format("it is cut off, and what stands before counts; {}", read.error().to_string()));
    return std::move(stage_);
  }

 private:
  Status read_layer() {
    if (scan_.take('(')) RETURN_IF_ERROR(read_layer_metadata());
    while (!scan_.is_at_end()) {
      const std::string_view word = scan_.word();
      if (word == "reorder") {
        RETURN_IF_ERROR(skip_reorder());
        continue;
      }
      RETURN_IF_ERROR(read_prim(word, std::nullopt, 0));
    }
    return {};
  }

  static bool begins_prim(std::string_view word) {
    return word == "def" || word == "over" || word == "class";
  }
  static bool is_list_edit(std::string_view word) {
    return word == "prepend" || word == "append" || word == "add" || word == "delete" || word == "reorder";
  }

  /// "reorder rootPrims = [..]"
  Status skip_reorder() {
    if (scan_.word().empty()) return scan_.error(ErrorCode::BadInput, "{} after 'reorder'", scan_.found());
    RETURN_IF_ERROR(scan_.expect('='));
    return scan_.skip_value();
  }

  /// Walks items "key = value" up to the bracket that ends them; `take_item` takes the value of a key.
  template <class TakeItem>
  Status read_metadata(const TakeItem& take_item) {
    while (!scan_.take(')')) {
      const char c = scan_.peek();
      if (c == '"' || c == '\'') {
        ASSIGN_OR_RETURN([[maybe_unused]] const std::string_view comment, scan_.string());
        continue;
      }
      std::string_view key = scan_.word();
      if (is_list_edit(key)) key = scan_.word();
      if (key.empty()) return scan_.error(ErrorCode::BadInput, "{} is no metadata", scan_.found());
      RETURN_IF_ERROR(scan_.expect('='));
      RETURN_IF_ERROR(take_item(key));
    }
    return {};
  }

  /// An error names the current line.
  Status here(const Status& status) const {
    return status ? status : Status(scan_.error(status.error().code, "{}", status.error().message));
  }

  Status read_layer_metadata() {
    return read_metadata([this](std::string_view key) -> Status {
      if (key == "upAxis") {
        ASSIGN_OR_RETURN(const std::string_view axis, scan_.string());
        set_up_axis(stage_, axis);
        return {};
      }
      if (key == "metersPerUnit") {
        ASSIGN_OR_RETURN(const double value, scan_.scalar());
        set_meters_per_unit(stage_, value);
        return {};
      }
      if (key == "kilogramsPerUnit") {
        ASSIGN_OR_RETURN(stage_.kilograms_per_unit, scan_.scalar());
        return {};
      }
      if (key == "subLayers") ++stage_.reference_count;
      return scan_.skip_value();
    });
  }

  Status read_prim_metadata(UsdPrim& prim) {
    return read_metadata([&](std::string_view key) -> Status {
      if (key == "active") {
        const std::string_view value = scan_.word();
        if (value == "false" || value == "0") prim.is_left_out = true;
        return {};
      }
      if (key == "references" || key == "payload" || key == "inherits" || key == "specializes")
        ++stage_.reference_count;
      return scan_.skip_value();
    });
  }

  /// From behind its specifier.
  Status read_prim(std::string_view specifier, std::optional<size_t> parent, size_t depth) {
    if (!begins_prim(specifier))
      return scan_.error(ErrorCode::BadInput, "{} found where a prim is needed",
                         specifier.empty() ? scan_.found() : quoted(specifier));
    if (depth == kMaxUsdDepth)
      return scan_.error(ErrorCode::LimitExceeded, "prims in each other, more than {}", kMaxUsdDepth);
    if (stage_.prim.size() == kMaxUsdPrims)
      return scan_.error(ErrorCode::LimitExceeded, "more than {} prims", kMaxUsdPrims);
    const std::string_view type = scan_.word();
    UsdPrim prim;
    ASSIGN_OR_RETURN(const std::string_view name, scan_.string());
    prim.parent = parent;
    prim.name = one_line(name, kMaxUsdNameChars);
    prim.is_left_out = specifier != "def";
    if (scan_.take('(')) RETURN_IF_ERROR(read_prim_metadata(prim));
    if (is_other_curves(type)) ++stage_.other_curve_count;
    if (type == "BasisCurves") prim.curves.emplace();
    prim.is_material = type == "Material";
    prim.is_instancer = type == kUsdInstancer;
    const size_t index = stage_.prim.size();
    stage_.prim.push_back(std::move(prim));
    RETURN_IF_ERROR(scan_.expect('{'));
    while (!scan_.take('}')) RETURN_IF_ERROR(read_item(index, depth));
    return {};
  }

  Status read_item(size_t index, size_t depth) {
    const std::string_view word = scan_.word();
    if (begins_prim(word)) return read_prim(word, index, depth + 1);
    if (word == "variantSet") {
      ++stage_.reference_count;
      ASSIGN_OR_RETURN([[maybe_unused]] const std::string_view name, scan_.string());
      RETURN_IF_ERROR(scan_.expect('='));
      return scan_.skip_value();
    }
    return read_property(word, index);
  }

  static bool is_modifier(std::string_view word) {
    return word == "custom" || word == "uniform" || word == "varying" || word == "config" ||
           is_list_edit(word);
  }

  Status read_property(std::string_view word, size_t index) {
    const bool is_reorder = word == "reorder";
    while (is_modifier(word)) word = scan_.word();
    if (word.empty()) return scan_.error(ErrorCode::BadInput, "{} is no property", scan_.found());
    // "reorder nameChildren = [..]" has no type.
    if (is_reorder && scan_.take('=')) return scan_.skip_value();
    if (scan_.take('[')) RETURN_IF_ERROR(scan_.expect(']'));
    const std::string_view name = scan_.word();
    if (name.empty()) return scan_.error(ErrorCode::BadInput, "{} is no property's name", scan_.found());
    if (scan_.take('=')) RETURN_IF_ERROR(read_value(name, index));
    return scan_.take('(') ? scan_.skip_rest(')') : Status();
  }

  Status read_value(std::string_view name, size_t index) {
    constexpr std::string_view kSamples = ".timeSamples";
    if (!name.ends_with(kSamples)) return take_value(name, index, std::nullopt);
    name.remove_suffix(kSamples.size());
    RETURN_IF_ERROR(scan_.expect('{'));
    if (scan_.take('}')) return {};
    ASSIGN_OR_RETURN(const double time, scan_.time_code());
    RETURN_IF_ERROR(take_value(name, index, time));
    return scan_.skip_rest('}');
  }

  /// The value of a property, of its first time sample where `time` is set: what has no time goes before.
  Status take_value(std::string_view name, size_t index, std::optional<double> time) {
    UsdPrim& prim = stage_.prim[index];
    if (name == "visibility") {
      ASSIGN_OR_RETURN(const std::string_view value, scan_.string());
      if (value == "invisible") prim.is_left_out = true;
      return {};
    }
    if (name == "purpose") {
      ASSIGN_OR_RETURN(const std::string_view value, scan_.string());
      prim.purpose = one_line(value, kMaxUsdWordChars);
      return {};
    }
    if (name == "xformOpOrder") {
      ASSIGN_OR_RETURN(const auto order, scan_.strings(kMaxUsdXformOps));
      prim.op_order.assign(order.begin(), order.end());
      return {};
    }
    if (std::optional<double>* const number = find_material_number(prim, name)) {
      ASSIGN_OR_RETURN(*number, scan_.scalar());
      return {};
    }
    if (name.starts_with("xformOp:")) return take_op(name, prim, time.has_value());
    if (prim.is_instancer && name == kUsdInstances) {
      ASSIGN_OR_RETURN(const auto instances, scan_.numbers(size_t{kMaxGroomVertices}));
      prim.instance_count = instances.size();
      return {};
    }
    return prim.curves ? take_curves(name, *prim.curves, time) : scan_.skip_value();
  }

  Status take_op(std::string_view name, UsdPrim& prim, bool is_sample) {
    ASSIGN_OR_RETURN(std::vector<double> value, scan_.numbers(kMatrixNumbers));
    return here(set_xform_op(prim, name, std::move(value), is_sample));
  }

  Status take_curves(std::string_view name, UsdCurves& curves, std::optional<double> time) {
    if (name == "points") {
      if (time && !curves.points.empty()) return scan_.skip_value();
      ASSIGN_OR_RETURN(curves.points, scan_.points(kMaxGroomVertices));
      curves.time_code = time;
      return {};
    }
    if (name == kUsdRestPoints) {
      if (time && !curves.rest_points.empty()) return scan_.skip_value();
      ASSIGN_OR_RETURN(curves.rest_points, scan_.points(kMaxGroomVertices));
      return {};
    }
    if (name == "curveVertexCounts") {
      if (time && !curves.vertex_counts.empty()) return scan_.skip_value();
      ASSIGN_OR_RETURN(curves.vertex_counts, scan_.counts(kMaxStrandCount));
      return {};
    }
    if (name == "widths") {
      if (time && !curves.widths.empty()) return scan_.skip_value();
      ASSIGN_OR_RETURN(curves.widths, scan_.floats(kMaxGroomVertices));
      return {};
    }
    if (std::vector<double>* const numbers = find_curves_numbers(curves, name)) {
      if (time && !numbers->empty()) return scan_.skip_value();
      ASSIGN_OR_RETURN(*numbers, scan_.numbers(2 * size_t{kMaxGroomVertices}));
      return {};
    }
    if (name == kUsdGroupName) {
      std::vector<std::string_view> texts(1);
      if (scan_.peek() == '[') {
        ASSIGN_OR_RETURN(texts, scan_.strings(kMaxStrandCount));
      } else {
        ASSIGN_OR_RETURN(texts.front(), scan_.string());
      }
      curves.group_names.clear();
      for (const std::string_view text : texts)
        curves.group_names.push_back(one_line(text, kMaxGroupNameChars));
      return {};
    }
    std::string* const word = find_curves_word(curves, name);
    if (word == nullptr) return scan_.skip_value();
    ASSIGN_OR_RETURN(const std::string_view value, scan_.string());
    *word = one_line(value, kMaxUsdWordChars);
    return {};
  }

  UsdaScan scan_;
  UsdStage stage_;
};

}  // namespace

Result<UsdStage> read_usda_stage(std::string_view text) {
  text = without_byte_order_mark(text);
  if (!text.starts_with("#usda 1."))
    return make_error(ErrorCode::BadInput, "does not begin with '#usda 1.0': not a USD text file");
  return StageReader(text).read();
}

}  // namespace strandcast
