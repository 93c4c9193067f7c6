// What a binary USD file states, by the names of prims and properties, read with the loader's own parts.
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "common/base/check.h"
#include "common/groom/usdc_archive.h"

namespace strandcast::test {

struct UsdcFound {
  explicit UsdcFound(const std::filesystem::path& path)
      : archive(std::move(*UsdcArchive::read(*GroomSource::open(path)))) {}

  /// The value of a field of a property, or of a prim where `property` is empty.
  std::optional<UsdcValue> find(std::string_view prim, std::string_view property,
                                std::string_view field = "default") const {
    for (const UsdcSpec& spec : archive.specs()) {
      const UsdcPath& path = archive.paths()[spec.path];
      const bool is_property = spec.kind == UsdcKind::Attribute;
      if (is_property == property.empty()) continue;
      const auto& of_prim = is_property ? archive.paths()[path.parent] : path;
      if (archive.token(of_prim.token) != prim || (is_property && archive.token(path.token) != property))
        continue;
      return *archive.field(spec, field);
    }
    return {};
  }
  UsdcValue get(std::string_view prim, std::string_view property, std::string_view field = "default") const {
    const auto value = find(prim, property, field);
    CHECK(value.has_value());
    return *value;
  }

  UsdcArchive archive;
};

}  // namespace strandcast::test
