#include "common/scene/shadow_methods.h"

#include <set>

namespace strandcast {
namespace {

using testing::HasSubstr;

TEST(ShadowMethods, AreFoundByTheNamesOfTheirRows) {
  for (const auto& [rows, kind] :
       {std::pair(shadow_methods().rows(), 0), std::pair(transparency_methods().rows(), 1),
        std::pair(antialiasing_methods().rows(), 2)}) {
    std::set<std::string_view> names;
    for (const MethodRow& row : rows) {
      EXPECT_TRUE(names.insert(row.name).second) << row.name;
      EXPECT_FALSE(row.summary.empty()) << row.name;
      const auto found = find_render_methods(kind == 0 ? row.name : "volume", kind == 1 ? row.name : "hashed",
                                             kind == 2 ? row.name : "analytic");
      ASSERT_TRUE(found) << found.error().to_string();
    }
  }
  EXPECT_EQ(*find_render_methods("volume", "hashed", "analytic"), RenderMethods{});
  EXPECT_EQ(find_render_methods("hybrid", "moments", "analytic")->shadow, ShadowMethod::Hybrid);
  EXPECT_EQ(find_render_methods("hybrid", "moments", "analytic")->transparency, TransparencyMethod::Moments);
}

TEST(ShadowMethods, RefuseAnUnknownNameAndSayWhichThereAre) {
  const auto unknown = find_render_methods("ray_traced", "hashed", "analytic");
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, ErrorCode::BadInput);
  EXPECT_THAT(unknown.error().message,
              HasSubstr("shadow method ray_traced is unknown (known: main, volume, none, deep_opac"));
  EXPECT_FALSE(find_render_methods("volume", "", "analytic"));
  EXPECT_FALSE(find_render_methods("volume", "hashed", "fxaa"));
}

TEST(ShadowMethods, RefuseSamplesForWhatIsBlended) {
  const auto both = find_render_methods("volume", "lists", "msaa4");
  ASSERT_FALSE(both);
  EXPECT_EQ(both.error().code, ErrorCode::BadInput);
  EXPECT_EQ(
      both.error().message,
      "antialiasing msaa4 goes with transparency hashed only: lists blends what analytic says of coverage");
}

}  // namespace
}  // namespace strandcast
