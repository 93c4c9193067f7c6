// Methods by which hair can be drawn, as rows of tables: a scene names one of each kind, shader variants are
// numbered like the enumerators. Pure data, any thread.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "common/base/check.h"

namespace strandcast {

/// The first row of every table, and what renderers without a choice do.
inline constexpr const char* kMainMethod = "main";

/// Names of rows. One kind of method has one such choice, whatever else is drawn.
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
/// How light that comes through other strands is taken into account.
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
  /// Of a name that is in the table.
  Method at(std::string_view name) const {
    const size_t row = find(name);
    CHECK(row < rows_.size());
    return static_cast<Method>(row);
  }
  const MethodRow& row(Method method) const { return rows_[static_cast<size_t>(method)]; }
  /// Said to whoever names another; names all that there are.
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
