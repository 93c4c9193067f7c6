#include "common/base/file_kind.h"

#include <array>
#include <fstream>
#include <string_view>

namespace strandcast {

std::string likely_kind(const std::filesystem::path& path) {
  struct Kind {
    std::string_view begin;
    const char* extension;
    const char* advice;
  };
  constexpr std::array<Kind, 15> kKinds = {{
      {"HIERARCHY", ".bvh",
       "it looks like a BVH clip, motion and no hair: strandcast-ctl feed --motion plays it"},
      {"version 2", ".tfx", "it looks like a TressFX 2 file: call it .tfx"},
      {{"\0\0\x40\x40", 4}, ".tfx", "it looks like a TressFX file: call it .tfx"},
      {{"\0\0\x80\x40", 4}, ".tfx", "it looks like a TressFX 4 file: call it .tfx"},
      {"HAIR", ".hair", "it looks like a .hair file: call it that"},
      {"ply", ".ply", "it looks like a .ply file: call it that"},
      {"#usda", ".usda", "it looks like USD as text: call it .usda"},
      {"PXR-USDC", ".usdc", "it looks like USD in binary: call it .usdc"},
      {"PK\x03\x04", ".usdz", "it is a zip archive, as USD is packed in: call it .usdz, or unpack it"},
      {"Ogawa", ".abc", "it looks like Alembic: call it .abc"},
      {"\x1f\x8b", "", "it is packed by gzip: unpack it (gunzip)"},
      {"Kaydara FBX", "", "it is FBX, which is not read: export motion as .bvh, hair as .abc or .usd"},
      {"glTF", "", "it is binary glTF, which is not read: export motion as .bvh, a head as .obj"},
      {"\xff\xfe", "", "it is UTF-16: save it as UTF-8"},
      {"\xfe\xff", "", "it is UTF-16: save it as UTF-8"},
  }};
  std::error_code failure;
  if (!std::filesystem::is_regular_file(path, failure)) return {};
  std::string begin(16, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<size_t>(file.gcount()));
  if (begin.empty()) return "it is empty";
  for (const Kind& kind : kKinds)
    if (begin.starts_with(kind.begin) && path.extension() != kind.extension) return kind.advice;
  return {};
}

}  // namespace strandcast
