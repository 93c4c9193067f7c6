// AbcCurves: strands of one curves object of an Alembic file at one sample, and its parameters. Untrusted
// input. Private to the loader; one thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/groom/abc_archive.h"

namespace strandcast {

enum class AbcCurveType : uint8_t { Cubic, Linear, VariableOrder };
enum class AbcBasis : uint8_t { None, Bezier, BSpline, CatmullRom, Hermite, Power };
enum class AbcScope : uint8_t { Constant, Strand, Vertex, Varying };  // one value for each of them

/// A value for each strand or vertex, possibly by indices.
struct AbcParam {
  std::string stated_scope;  // "uni"; empty: the file does not say
  AbcSample values;
  std::optional<std::vector<uint32_t>> indices;  // each below the number of values

  size_t count() const { return indices ? indices->size() : values.count(); }
  double number(size_t element, uint32_t axis = 0) const {
    return values.number(indices ? (*indices)[element] : element, axis);
  }
};

struct AbcCurves {
  AbcCurveType type = AbcCurveType::Linear;
  bool is_periodic = false;
  AbcBasis basis = AbcBasis::None;
  bool is_double = false;  // points were in double precision
  std::vector<uint32_t> vertex_counts;
  std::vector<glm::vec3> points;
  std::vector<std::string> notes;  // of points too few or too many

  /// Finds what the values of a parameter belong to: what it states if their number fits, else what fits.
  /// Empty if nothing does.
  std::optional<AbcScope> scope_of(const AbcParam& param) const;
  /// Returns whether positions are on the strands, rather than beside them.
  bool is_on_strand() const { return type == AbcCurveType::Linear; }
};

class AbcCurvesReader {
 public:
  /// Finds the properties of a curves object. BadInput if one is missing or of another type.
  static Result<AbcCurvesReader> open(const AbcArchive& archive, const AbcObject& object);

  uint64_t sample_count() const { return points_.sample_count; }
  double time_s(uint64_t sample) const { return archive_->time_s(points_, sample); }
  /// Reads strands; none if there is no sample. BadInput for counts that do not fit (as fit_points()) and
  /// unknown kinds; points may be no numbers. LimitExceeded for more than these strands or vertices.
  Result<AbcCurves> read(uint64_t sample, uint64_t strand_limit, uint64_t vertex_limit) const;
  /// Reads a parameter of the schema ("width") or a free one ("groom_guide"); empty if there is none.
  Result<std::optional<AbcParam>> param(std::string_view name, uint64_t sample) const;
  /// Reads texts, one for each strand or one for all; none if there are none.
  Result<std::vector<std::string>> texts(std::string_view name, uint64_t sample) const;
  /// Returns the free parameters.
  const std::vector<AbcProperty>& free_params() const { return free_; }

 private:
  explicit AbcCurvesReader(const AbcArchive& archive) : archive_(&archive) {}

  const AbcArchive* archive_;
  std::vector<AbcProperty> own_, free_;
  AbcProperty points_, counts_, kinds_;
};

}  // namespace strandcast
