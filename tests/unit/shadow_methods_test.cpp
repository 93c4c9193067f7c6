#include "common/scene/shadow_methods.h"

#include <set>

namespace strandcast::shadow_methods_test {
namespace {

using testing::HasSubstr;

/// Every row of a table is found under its name in `field`, by its number in `member`.
template <class Method>
void expect_found(const MethodTable<Method>& table, std::string RenderMethodsDesc::*field,
                  Method RenderMethods::*member) {
  std::set<std::string_view> names;
  for (size_t i = 0; i < table.rows().size(); ++i) {
    const MethodRow& row = table.rows()[i];
    EXPECT_TRUE(names.insert(row.name).second) << row.name;
    EXPECT_FALSE(row.summary.empty()) << row.name;
    RenderMethodsDesc wanted;
    wanted.*field = row.name;
    const auto found = find_render_methods(wanted);
    ASSERT_TRUE(found) << found.error().to_string();
    EXPECT_EQ((*found).*member, static_cast<Method>(i)) << row.name;
  }
}

TEST(ShadowMethods, AreFoundByTheNamesOfTheirRows) {
  expect_found(shadow_methods(), &RenderMethodsDesc::shadow, &RenderMethods::shadow);
  expect_found(transparency_methods(), &RenderMethodsDesc::transparency, &RenderMethods::transparency);
  expect_found(antialiasing_methods(), &RenderMethodsDesc::antialiasing, &RenderMethods::antialiasing);
  expect_found(curve_methods(), &RenderMethodsDesc::curve, &RenderMethods::curve);
  expect_found(joint_methods(), &RenderMethodsDesc::joints, &RenderMethods::joints);
  expect_found(detail_methods(), &RenderMethodsDesc::detail, &RenderMethods::detail);
  expect_found(culling_methods(), &RenderMethodsDesc::culling, &RenderMethods::culling);
  expect_found(shadow_details(), &RenderMethodsDesc::shadow_detail, &RenderMethods::shadow_detail);
  EXPECT_EQ(*find_render_methods({}), RenderMethods{});
}

TEST(ShadowMethods, RefuseAnUnknownNameAndSayWhichThereAre) {
  const auto unknown = find_render_methods({.shadow = "ray_traced"});
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, ErrorCode::BadInput);
  EXPECT_THAT(unknown.error().message,
              HasSubstr("shadow method ray_traced is unknown (known: main, volume, none, deep_opac"));
  EXPECT_FALSE(find_render_methods({.transparency = ""}));
  EXPECT_FALSE(find_render_methods({.antialiasing = "fxaa"}));
}

TEST(ShadowMethods, RefuseSamplesForWhatIsBlended) {
  const auto both = find_render_methods({.transparency = "lists", .antialiasing = "msaa4"});
  ASSERT_FALSE(both);
  EXPECT_EQ(both.error().code, ErrorCode::BadInput);
  EXPECT_EQ(
      both.error().message,
      "antialiasing msaa4 goes with transparency hashed only: lists blends what analytic says of coverage");
}

TEST(ShadowMethods, RefuseWhatReadsTheDepthOfSamplesWhereThereIsNone) {
  for (const RenderMethodsDesc& names : {RenderMethodsDesc{.antialiasing = "msaa4", .culling = "occlusion"},
                                         RenderMethodsDesc{.antialiasing = "msaa4", .detail = "volume"},
                                         RenderMethodsDesc{.transparency = "moments", .detail = "volume"}}) {
    EXPECT_STRNE(method_conflict(names), "");
    const auto found = find_render_methods(names);
    ASSERT_FALSE(found);
    EXPECT_EQ(found.error().message, method_conflict(names));
  }
  EXPECT_STREQ(method_conflict({.antialiasing = "msaa4", .culling = "frustum"}), "");
}

}  // namespace
}  // namespace strandcast::shadow_methods_test
