// The list of parameters that a server gives: made of the fields of scenes and of the solvers' table, so that
// it cannot lack any.
#include "server/source/scene_parameters.h"

#include <gmock/gmock.h>

#include <limits>
#include <set>

#include "common/scene/scene_file.h"
#include "server/app/parameter_watch.h"
#include "server/sim/solver_registry.h"
#include "server/source/scene_change.h"

namespace strandcast::scene_parameters_test {
namespace {

using testing::HasSubstr;

const ParameterInfo* find(const std::vector<ParameterInfo>& list, const std::string& path) {
  const auto found =
      std::find_if(list.begin(), list.end(), [&](const ParameterInfo& info) { return info.path == path; });
  return found == list.end() ? nullptr : &*found;
}

TEST(SceneParameters, HaveUnitRangeDefaultAndValue) {
  SceneDesc scene = built_in_scene();
  scene.stream.bound_m = 0.0003f;
  scene.solver.parameters["damping"] = 0.5;
  const auto list = list_parameters(scene);
  const ParameterInfo* bound = find(list, "stream.bound_m");
  ASSERT_NE(bound, nullptr);
  EXPECT_EQ(bound->value, "0.0003");
  EXPECT_EQ(bound->unset_value, "0.0001");
  EXPECT_EQ(bound->unit, "m");
  EXPECT_TRUE(bound->has_range && bound->is_live);
  EXPECT_EQ(bound->minimum, 1e-6);
  EXPECT_EQ(bound->maximum, 5e-4);
  const ParameterInfo* strands = find(list, "groom.procedural.strand_count");
  ASSERT_NE(strands, nullptr);
  EXPECT_FALSE(strands->is_live);
  const ParameterInfo* collider = find(list, "head.collider");
  ASSERT_NE(collider, nullptr);
  EXPECT_EQ(collider->note, "known: field, spheres");
}

TEST(SceneParameters, ThoseOfEverySolverAreThere) {
  for (const SolverRow& row : solver_table()) {
    SceneDesc scene = built_in_scene();
    scene.solver.name = row.name;
    fit_to_solver(scene);
    const auto list = list_parameters(scene);
    for (const SolverParameterInfo& parameter : row.parameters) {
      const ParameterInfo* info = find(list, "solver.parameters." + parameter.name);
      ASSERT_NE(info, nullptr) << row.name << " " << parameter.name;
      EXPECT_EQ(info->unit, parameter.unit);
      EXPECT_EQ(info->minimum, parameter.minimum);
      EXPECT_EQ(info->maximum, parameter.maximum);
      EXPECT_TRUE(info->is_live);
    }
  }
}

// What is listed with its value can be set to it.
TEST(SceneParameters, EveryLivePathIsAnAssignment) {
  const SceneDesc scene = built_in_scene();
  std::set<std::string> paths;
  for (const ParameterInfo& info : list_parameters(scene)) {
    EXPECT_TRUE(paths.insert(info.path).second) << info.path;
    if (!info.is_live) continue;
    const auto changed = change_scene(scene, info.path + "=" + info.value);
    EXPECT_TRUE(changed) << info.path << ": " << changed.error().to_string();
  }
  EXPECT_GT(paths.size(), 100u);
}

// A refused change says the range, of fields and of the solver's own.
TEST(SceneParameters, ARefusedValueIsToldItsRange) {
  const SceneDesc scene = built_in_scene();
  for (const ParameterInfo& info : list_parameters(scene)) {
    if (!info.is_live || !info.has_range || info.value.starts_with("{")) continue;
    const auto refused = change_scene(scene, fmt::format("{}={}", info.path, info.maximum + 1.0));
    ASSERT_FALSE(refused) << info.path;
    // What no 32 bits hold is refused before anybody asks for the field's own range.
    const bool is_type_limit = info.maximum == std::numeric_limits<uint32_t>::max();
    EXPECT_THAT(refused.error().to_string(),
                is_type_limit ? testing::AnyOf(HasSubstr("out of range"), HasSubstr("Integer out"))
                              : testing::AnyOf(HasSubstr(fmt::format("{:g}", info.maximum)),
                                               HasSubstr(fmt::format("{}", info.maximum))))
        << info.path;
  }
}

TEST(SceneParameters, ListsFitIntoAMessageAndGoOnFromWhereTheyEnd) {
  const auto all = list_parameters(built_in_scene());
  ParameterRequest request;
  std::vector<ParameterInfo> joined;
  while (true) {
    const ParameterList list = list_of(all, request);
    EXPECT_LE(encode(ServerMessage(list)).size(), kMaxControlBytes);
    EXPECT_EQ(list.total, all.size());
    if (list.parameters.empty()) break;
    joined.insert(joined.end(), list.parameters.begin(), list.parameters.end());
    request.first += static_cast<uint32_t>(list.parameters.size());
  }
  EXPECT_EQ(joined, all);
  const ParameterList shading = list_of(all, {"look.shading.", 0, false});
  EXPECT_GT(shading.total, 10u);
  for (const ParameterInfo& info : shading.parameters) EXPECT_TRUE(info.path.starts_with("look.shading."));
  // Of the longest texts, too.
  ParameterList longest;
  for (uint32_t i = 0; i < kMaxListedParameters; ++i)
    longest.parameters.push_back({std::string(kMaxParameterPathBytes, 'p'),
                                  std::string(kMaxParameterTextBytes, 'v'),
                                  std::string(kMaxParameterTextBytes, 'u'), std::string(kMaxNameChars, 'm'),
                                  true, -1.5, 1.5, true, std::string(kMaxParameterTextBytes, 'n')});
  const auto bytes = encode(ServerMessage(longest));
  EXPECT_LE(bytes.size(), kMaxControlBytes);
  EXPECT_TRUE(decode_server_message(bytes));
}

TEST(ParameterWatch, TellsWhoWantsItWhatIsOther) {
  SceneDesc scene = built_in_scene();
  ParameterWatch watch;
  EXPECT_TRUE(watch.is_empty());
  watch.add(1, "look.", list_parameters(scene));
  watch.add(2, "", list_parameters(scene));
  EXPECT_TRUE(watch.news(list_parameters(scene)).empty());
  scene.look.ambient = 0.75f;
  scene.substeps = 3;
  const auto news = watch.news(list_parameters(scene));
  ASSERT_EQ(news.size(), 2u);
  EXPECT_EQ(news[0].first, 1u);
  ASSERT_EQ(news[0].second.parameters.size(), 1u);
  EXPECT_EQ(news[0].second.parameters[0].path, "look.ambient");
  EXPECT_EQ(news[0].second.parameters[0].value, "0.75");
  EXPECT_TRUE(news[0].second.is_change);
  EXPECT_EQ(news[1].second.parameters.size(), 2u);
  EXPECT_TRUE(watch.news(list_parameters(scene)).empty()) << "told once";
  watch.remove(1);
  watch.remove(2);
  EXPECT_TRUE(watch.is_empty());
}

TEST(ParameterWatch, TellsOfSeveralPrefixes) {
  SceneDesc scene = built_in_scene();
  ParameterWatch watch;
  watch.add(1, "quality,hair.", list_parameters(scene));
  scene.look.ambient = 0.75f;
  EXPECT_TRUE(watch.news(list_parameters(scene)).empty()) << "not asked for";
  scene.hair.wind = 2.0;
  scene.quality = kFullQuality;
  const auto news = watch.news(list_parameters(scene));
  ASSERT_EQ(news.size(), 1u);
  EXPECT_EQ(news[0].second.parameters.size(), 2u);
  EXPECT_TRUE(begins_so("hair.wind", "")) << "all";
  EXPECT_FALSE(begins_so("look.ambient", "quality,hair."));
  EXPECT_FALSE(begins_so("hai", "quality,hair."));
}

}  // namespace
}  // namespace strandcast::scene_parameters_test
