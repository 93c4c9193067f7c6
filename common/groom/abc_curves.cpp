#include "common/groom/abc_curves.h"

#include <algorithm>
#include <array>
#include <utility>

#include "common/groom/stated_groom.h"
#include "common/groom/text_scan.h"
#include "common/groom/usable_strands.h"

namespace strandcast {
namespace {

constexpr uint32_t kKindNumbers = 4;  // type, wrap, basis, basis again

bool is_whole_number(AbcPod pod) {
  return pod >= AbcPod::U8 && pod <= AbcPod::I64;
}

bool is_number(AbcPod pod) {
  return pod <= AbcPod::I64 || pod == AbcPod::Float || pod == AbcPod::Double;
}

Result<AbcProperty> needed(const std::vector<AbcProperty>& properties, std::string_view name) {
  const AbcProperty* const found = find_abc_property(properties, name);
  if (found == nullptr) return make_error(ErrorCode::BadInput, "it has no '{}'", name);
  return *found;
}

/// Points of all segments as cubic curves count them, and one more for each strand.
size_t varying_count(const AbcCurves& curves) {
  if (curves.type == AbcCurveType::Linear) return curves.points.size();
  const uint32_t step = curves.basis == AbcBasis::Bezier ? 3 : 1;
  size_t total = 0;
  for (const uint32_t count : curves.vertex_counts) total += count < 4 ? 2 : (count - 4) / step + 2;
  return total;
}

Status read_kinds(const AbcSample& sample, AbcCurves& curves) {
  const auto number = [&](uint32_t axis) { return static_cast<int>(sample.number(0, axis)); };
  const int type = number(0), wrap = number(1), basis = number(2);
  if (type > static_cast<int>(AbcCurveType::VariableOrder))
    return make_error(ErrorCode::BadInput, "curve type {}, known are 0 to 2", type);
  if (wrap > 1) return make_error(ErrorCode::BadInput, "curve wrap {}, known are 0 and 1", wrap);
  if (basis > static_cast<int>(AbcBasis::Power))
    return make_error(ErrorCode::BadInput, "curve basis {}, known are 0 to 5", basis);
  curves.type = static_cast<AbcCurveType>(type);
  curves.is_periodic = wrap == 1;
  curves.basis = static_cast<AbcBasis>(basis);
  return {};
}

Status read_counts(const AbcSample& sample, uint64_t vertex_limit, AbcCurves& curves) {
  uint64_t total = 0;
  for (size_t strand = 0; strand < sample.count(); ++strand) {
    const double count = sample.number(strand);
    if (!(count >= 0.0 && count <= static_cast<double>(kMaxGroomVertices)))
      return make_error(ErrorCode::BadInput, "strand {} has {} vertices", strand, count);
    curves.vertex_counts.push_back(static_cast<uint32_t>(count));
    total += curves.vertex_counts.back();
  }
  RETURN_IF_ERROR(fit_points(curves.points, curves.vertex_counts, "nVertices", curves.notes));
  if (total <= vertex_limit) return {};
  return make_error(ErrorCode::LimitExceeded, "nVertices need {} points, {} are allowed", total,
                    vertex_limit);
}

}  // namespace

std::optional<AbcScope> AbcCurves::scope_of(const AbcParam& param) const {
  const size_t count = param.count();
  const std::array<std::pair<AbcScope, size_t>, 4> choices = {{{AbcScope::Constant, 1},
                                                               {AbcScope::Strand, vertex_counts.size()},
                                                               {AbcScope::Vertex, points.size()},
                                                               {AbcScope::Varying, varying_count(*this)}}};
  const std::string& stated = param.stated_scope;
  const AbcScope wanted = stated == "uni"                      ? AbcScope::Strand
                          : stated == "vtx" || stated == "fvr" ? AbcScope::Vertex
                          : stated == "var"                    ? AbcScope::Varying
                                                               : AbcScope::Constant;
  const auto wanted_choice = choices[static_cast<size_t>(wanted)];
  if (!stated.empty() && wanted_choice.second == count) return wanted;
  for (const auto& [scope, fitting] : choices)
    if (fitting == count) return scope;
  return std::nullopt;
}

Result<AbcCurvesReader> AbcCurvesReader::open(const AbcArchive& archive, const AbcObject& object) {
  AbcCurvesReader reader(archive);
  ASSIGN_OR_RETURN(const auto of_object, archive.properties(object));
  ASSIGN_OR_RETURN(const AbcProperty geom, needed(of_object, ".geom"));
  ASSIGN_OR_RETURN(reader.own_, archive.properties(geom));
  ASSIGN_OR_RETURN(reader.points_, needed(reader.own_, "P"));
  ASSIGN_OR_RETURN(reader.counts_, needed(reader.own_, "nVertices"));
  ASSIGN_OR_RETURN(reader.kinds_, needed(reader.own_, "curveBasisAndType"));
  const auto fail = [](const AbcProperty& property, const char* wanted) {
    return make_error(ErrorCode::BadInput, "'{}' has element type {} and extent {}, {}", property.name,
                      static_cast<int>(property.pod), property.extent, wanted);
  };
  const AbcProperty& points = reader.points_;
  const bool has_points = points.kind == AbcPropertyKind::Array && points.extent == 3 &&
                          (points.pod == AbcPod::Float || points.pod == AbcPod::Double);
  if (!has_points) return fail(points, "points are three floats each");
  if (reader.counts_.kind != AbcPropertyKind::Array || !is_whole_number(reader.counts_.pod))
    return fail(reader.counts_, "counts are whole numbers");
  if (reader.kinds_.kind != AbcPropertyKind::Scalar || reader.kinds_.pod != AbcPod::U8 ||
      reader.kinds_.extent < kKindNumbers)
    return fail(reader.kinds_, "four small numbers belong there");
  if (const AbcProperty* free = find_abc_property(reader.own_, ".arbGeomParams"); free != nullptr) {
    ASSIGN_OR_RETURN(reader.free_, archive.properties(*free));
  }
  return reader;
}

Result<AbcCurves> AbcCurvesReader::read(uint64_t sample, uint64_t strand_limit, uint64_t vertex_limit) const {
  AbcCurves curves;
  ASSIGN_OR_RETURN(const AbcSample kinds, archive_->sample(kinds_, sample, 1));
  if (points_.sample_count == 0 || counts_.sample_count == 0 || kinds.count() == 0) return curves;
  RETURN_IF_ERROR(read_kinds(kinds, curves));
  ASSIGN_OR_RETURN(const AbcSample points, archive_->sample(points_, sample, vertex_limit));
  ASSIGN_OR_RETURN(const AbcSample counts, archive_->sample(counts_, sample, strand_limit));
  curves.is_double = points.pod == AbcPod::Double;
  curves.points.resize(points.count());
  if (!curves.is_double && !curves.points.empty())
    std::memcpy(curves.points.data(), points.bytes.data(), points.bytes.size());
  for (size_t i = 0; curves.is_double && i < curves.points.size(); ++i) {
    for (uint32_t axis = 0; axis < 3; ++axis)
      curves.points[i][static_cast<int>(axis)] = static_cast<float>(points.number(i, axis));
  }
  RETURN_IF_ERROR(read_counts(counts, vertex_limit, curves));
  return curves;
}

Result<std::vector<std::string>> AbcCurvesReader::texts(std::string_view name, uint64_t sample) const {
  const AbcProperty* property = find_abc_property(free_, name);
  std::vector<AbcProperty> parts;
  std::optional<AbcSample> indices;
  if (property != nullptr && property->kind == AbcPropertyKind::Compound) {
    ASSIGN_OR_RETURN(parts, archive_->properties(*property));
    property = find_abc_property(parts, ".vals");
    const AbcProperty* const places = find_abc_property(parts, ".indices");
    if (places == nullptr || !is_whole_number(places->pod)) return std::vector<std::string>();
    ASSIGN_OR_RETURN(indices, archive_->sample(*places, sample, kMaxStrandCount));
  }
  if (property == nullptr || property->pod != AbcPod::String || property->sample_count == 0)
    return std::vector<std::string>();
  ASSIGN_OR_RETURN(const AbcSample read, archive_->sample(*property, sample, kMaxStrandCount));
  std::vector<std::string> values = read.texts();
  for (std::string& value : values) value = one_line(value, kMaxGroupNameChars);
  if (!indices) return values;
  std::vector<std::string> texts;
  for (size_t i = 0; i < indices->count(); ++i) {
    const double index = indices->number(i);
    if (!(index >= 0.0 && index < static_cast<double>(values.size())))
      return make_error(ErrorCode::BadInput, "'{}' has indices beyond its {} texts", name, values.size());
    texts.push_back(values[static_cast<size_t>(index)]);
  }
  return texts;
}

Result<std::optional<AbcParam>> AbcCurvesReader::param(std::string_view name, uint64_t sample) const {
  const AbcProperty* property = find_abc_property(own_, name);
  if (property == nullptr) property = find_abc_property(free_, name);
  if (property == nullptr) return std::optional<AbcParam>();
  AbcParam param;
  param.stated_scope = abc_metadata_value(property->metadata, "geoScope");
  std::vector<AbcProperty> parts;
  if (property->kind == AbcPropertyKind::Compound) {
    ASSIGN_OR_RETURN(parts, archive_->properties(*property));
    const AbcProperty* const indices = find_abc_property(parts, ".indices");
    property = find_abc_property(parts, ".vals");
    if (property == nullptr || indices == nullptr || !is_whole_number(indices->pod))
      return std::optional<AbcParam>();
    ASSIGN_OR_RETURN(const AbcSample read, archive_->sample(*indices, sample, kMaxGroomVertices));
    param.indices.emplace();
    for (size_t i = 0; i < read.count(); ++i) {
      const double index = read.number(i);
      const bool is_index = index >= 0.0 && index < static_cast<double>(kMaxGroomVertices);
      param.indices->push_back(is_index ? static_cast<uint32_t>(index) : ~0u);
    }
  }
  if (!is_number(property->pod) || property->sample_count == 0) return std::optional<AbcParam>();
  ASSIGN_OR_RETURN(param.values, archive_->sample(*property, sample, kMaxGroomVertices));
  if (param.indices && std::any_of(param.indices->begin(), param.indices->end(),
                                   [&](uint32_t index) { return index >= param.values.count(); }))
    return make_error(ErrorCode::BadInput, "'{}' has indices beyond its {} values", name,
                      param.values.count());
  return std::optional(std::move(param));
}

}  // namespace strandcast
