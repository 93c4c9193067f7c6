// Methods of drawing hair, as rows of tables. A scene names one of each kind; shader variants have the
// numbers of the enumerators. Pure data, any thread.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "common/base/check.h"

namespace strandcast {

/// Name of the first row of every table; renderers without a choice use it.
inline constexpr const char* kMainMethod = "main";

/// One method of each kind, by name of its row.
struct RenderMethodsDesc {
  std::string shading = kMainMethod;
  std::string scattering = kMainMethod;
  std::string evaluation = kMainMethod;
  std::string shadow = kMainMethod;
  std::string transparency = kMainMethod;
  std::string antialiasing = kMainMethod;
  std::string curve = kMainMethod;
  std::string joints = kMainMethod;
  std::string detail = kMainMethod;
  std::string culling = kMainMethod;
  std::string shadow_detail = kMainMethod;

  bool operator==(const RenderMethodsDesc&) const = default;
};

/// How one strand scatters light.
enum class ShadingModel : uint8_t { Sadeghi, KajiyaKay, Karis, Chiang, Marschner };
/// How light that passes through other strands is computed.
enum class ScatteringModel : uint8_t { Volume, None, Isosurface, Dual };
/// Where the light of a strand is computed.
enum class ShadingPlace : uint8_t { Vertex, Fragment };

struct MethodRow {
  std::string_view name;
  std::string_view summary;
};

/// Methods of one kind. Row i is enumerator i.
template <class Method>
class MethodTable {
 public:
  explicit MethodTable(std::span<const MethodRow> rows) : rows_(rows) {
    refusal_ = std::string("is unknown (known: ") + kMainMethod;
    for (const MethodRow& row : rows) refusal_ += ", " + std::string(row.name);
    refusal_ += ")";
  }
  std::span<const MethodRow> rows() const { return rows_; }
  bool has(std::string_view name) const { return find(name) < rows_.size(); }
  /// Returns the method of a name that is in the table.
  Method at(std::string_view name) const {
    const size_t row = find(name);
    CHECK(row < rows_.size());
    return static_cast<Method>(row);
  }
  const MethodRow& row(Method method) const { return rows_[static_cast<size_t>(method)]; }
  /// Error sentence for an unknown name; it lists all names.
  const char* refusal() const { return refusal_.c_str(); }

 private:
  size_t find(std::string_view name) const {
    if (name == kMainMethod) return 0;
    size_t row = 0;
    while (row < rows_.size() && rows_[row].name != name) ++row;
    return row;
  }

  std::span<const MethodRow> rows_;
  std::string refusal_;
};

const MethodTable<ShadingModel>& shading_models();
const MethodTable<ScatteringModel>& scattering_models();
const MethodTable<ShadingPlace>& shading_places();

}  // namespace strandcast
