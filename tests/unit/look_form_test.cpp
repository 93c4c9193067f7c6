// The panel of the look without a window: which fields it has, what a person's changes become and for whom.
#include "client/app/look_form.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <imgui.h>

#include <algorithm>
#include <fstream>
#include <set>
#include <utility>

#include "client/app/hair_sliders.h"
#include "client/app/save_scene.h"
#include "client/window/form.h"
#include "client/window/hud.h"
#include "common/base/file.h"
#include "common/base/units.h"
#include "common/scene/scene_file.h"
#include "tests/support/look_variants.h"
#include "tests/support/sample_look.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::look_form_test {
namespace {

using testing::Contains;
using testing::HasSubstr;

const FormField& field_of(const std::vector<FormField>& fields, const std::string& path) {
  const auto found =
      std::find_if(fields.begin(), fields.end(), [&](const FormField& field) { return field.path == path; });
  EXPECT_NE(found, fields.end()) << path;
  return *found;
}

TEST(LookForm, HasEveryFieldOfALookWithItsRangeAndItsValue) {
  const LookDesc look = sample_look();
  const std::vector<FormField> fields = look_fields(look);
  const auto expected = test::fields_of(look);
  ASSERT_EQ(fields.size(), expected.size());
  for (const auto& [path, value] : expected) {
    const FormField& field = field_of(fields, path);
    EXPECT_EQ(field.value, value) << path;
    EXPECT_FALSE(field.title.empty() || field.section.empty()) << path;
    EXPECT_LE(field.minimum, field.maximum) << path;
    EXPECT_GT(field.handy_maximum, std::holds_alternative<std::string>(value) ? -1.0 : field.minimum) << path;
    EXPECT_LE(field.handy_maximum, field.maximum) << path;
  }
  // Those of a section stand together, and no two are called alike.
  std::set<std::string> done, titles;
  std::string section;
  for (const FormField& field : fields) {
    if (field.section != std::exchange(section, field.section)) {
      EXPECT_TRUE(done.insert(field.section).second) << field.section;
    }
    EXPECT_TRUE(titles.insert(field.section + field.title).second) << field.path;
  }
  EXPECT_THAT(done, Contains("Style"));
  EXPECT_EQ(fields.front().path, "hair_color");
}

TEST(LookForm, ShowsWhatAPersonExpects) {
  LookDesc look;
  const std::vector<FormField> fields = look_fields(look);
  const FormField& color = field_of(fields, "hair_color");
  EXPECT_EQ(color.widget, FormWidget::Choice);
  for (const char* name : {"custom", "melanin", "black", "brown", "blond", "red", "grey", "dyed"})
    EXPECT_THAT(color.choices, Contains(name));
  for (const std::string& name : color.choices) EXPECT_TRUE(is_hair_color(name)) << name;
  const FormField& radius = field_of(fields, "strand_radius_m");
  EXPECT_EQ(radius.unit, "mm");
  EXPECT_EQ(radius.shown_per_unit, 1e3);
  EXPECT_EQ(field_of(fields, "light_direction").widget, FormWidget::Direction);
  EXPECT_EQ(field_of(fields, "followers").widget, FormWidget::Whole);
  EXPECT_EQ(field_of(fields, "skin_color").widget, FormWidget::Color);
  EXPECT_EQ(field_of(fields, "shading.cuticle_deg").unit, "degrees");
  EXPECT_EQ(field_of(fields, "shading.cuticle_deg").title, "cuticle") << "a field without a row of its own";
  // What decides nothing now is not to be turned.
  EXPECT_FALSE(field_of(fields, "root_color").is_idle);
  EXPECT_TRUE(field_of(fields, "eumelanin").is_idle);
  look.hair_color = "red";
  EXPECT_TRUE(field_of(look_fields(look), "root_color").is_idle);
  look.hair_color = "melanin";
  EXPECT_FALSE(field_of(look_fields(look), "eumelanin").is_idle);
  // Other methods than the main ones know nothing of locks.
  EXPECT_FALSE(field_of(fields, "style.clump").is_idle);
  look.methods.shading = "marschner";
  EXPECT_TRUE(field_of(look_fields(look), "style.clump").is_idle);
  EXPECT_FALSE(field_of(look_fields(look), "shading.wetness").is_idle);
}

TEST(LookForm, WhatIsSetReadsBackFieldByFieldAndAllAtOnce) {
  std::vector<FormEdit> all;
  for (const auto& [path, value] : test::fields_of(sample_look())) all.push_back({path, value});
  const auto looks = test::looks_one_field_apart(LookDesc{}, sample_look());
  for (size_t i = 0; i < all.size(); ++i) {
    const auto changed = with_edits(LookDesc{}, {all[i]});
    ASSERT_TRUE(changed) << changed.error().to_string();
    EXPECT_EQ(*changed, looks[i].second) << look_assignment({all[i]});
  }
  const auto changed = with_edits(LookDesc{}, all);
  ASSERT_TRUE(changed) << changed.error().to_string();
  EXPECT_EQ(*changed, sample_look());
  EXPECT_LE(look_assignment(all).size(), kMaxAssignmentBytes) << "what one SetParameter takes";
  EXPECT_EQ(look_assignment({{"style.clump", 0.5}}), "look={ style { clump: 0.5 } }");
  const auto refused = with_edits(LookDesc{}, {{"hair_color", std::string("\" ambient: 9 #")}});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().to_string(), HasSubstr("look.hair_color must be custom")) << "text stays text";
}

TEST(LookForm, ColoursOfOnesOwnBeginWithThoseThatAreSeen) {
  LookControl control;
  LookDesc look = sample_look();
  look.hair_color = "red";
  control.follow({look, {}}, false);
  ASSERT_TRUE(control.edit({{"hair_color", std::string("custom")}}, kSInNs));
  EXPECT_EQ(control.shown(kSInNs).hair_color, "custom");
  EXPECT_EQ(control.shown(kSInNs).root_color, colors_of(look).root);
  EXPECT_EQ(control.shown(kSInNs).tip_color, colors_of(look).tip);
  ASSERT_TRUE(control.edit({{"tip_color", glm::vec3(0.5f)}}, kSInNs));
  ASSERT_TRUE(control.edit({{"hair_color", std::string("custom")}}, kSInNs));
  EXPECT_EQ(control.shown(kSInNs).tip_color, glm::vec3(0.5f)) << "they are one's own already";
}

TEST(Form, DirectionsAreTwoAngles) {
  const DirectionAngles front = angles_of({0.0f, 0.0f, -2.0f});
  EXPECT_NEAR(front.azimuth_deg, 0.0, 1e-5);
  EXPECT_NEAR(front.elevation_deg, 0.0, 1e-5);
  EXPECT_NEAR(angles_of({0.0f, -1.0f, 0.0f}).elevation_deg, 90.0, 1e-4);
  EXPECT_NEAR(angles_of({-1.0f, 0.0f, 0.0f}).azimuth_deg, 90.0, 1e-5);
  for (const glm::vec3& direction :
       {LookDesc{}.light_direction, LookDesc{}.rim_direction, glm::vec3(3, -4, 5)}) {
    const glm::vec3 again = direction_of(angles_of(direction), glm::length(direction));
    EXPECT_LT(glm::distance(again, direction), 1e-5f * glm::length(direction));
  }
  for (const float linear : {0.0f, 0.001f, 0.2f, 1.0f})
    EXPECT_NEAR(from_srgb(to_srgb(linear)), linear, 1e-6f);
  EXPECT_NEAR(to_srgb(0.2f), 0.4845f, 1e-4f);
}

LookChange scene_with(const LookDesc& look) {
  return {look, {}};
}

// Ten times a second, the newest of each field, and everybody's other fields are left alone.
TEST(LookControl, WhoSteersChangesTheSceneForAll) {
  LookControl control;
  control.follow(scene_with(sample_look()), true);
  EXPECT_FALSE(control.take_assignment(kSInNs)) << "nothing was done";
  ASSERT_TRUE(control.edit({{"exposure", 1.5}, {"style.clump", 0.5}}, kSInNs));
  const auto first = control.take_assignment(kSInNs);
  ASSERT_TRUE(first);
  EXPECT_THAT(*first, testing::AllOf(HasSubstr("exposure: 1.5"), HasSubstr("style { clump: 0.5 }")));
  size_t sent = 0;
  std::string last;
  int64_t time_ns = kSInNs;
  for (int i = 1; i <= 100; ++i) {
    time_ns += kSInNs / 100;
    ASSERT_TRUE(control.edit({{"exposure", 1.5 + 0.01 * i}}, time_ns));
    if (const auto assignment = control.take_assignment(time_ns)) {
      ++sent;
      last = *assignment;
    }
  }
  EXPECT_LE(sent, 10u);
  EXPECT_GE(sent, 9u);
  if (const auto rest = control.take_assignment(time_ns + kLookSendNs)) last = *rest;
  EXPECT_EQ(last, "look={ exposure: 2.5 }") << "the last word is sent, and nothing that was said before";
  EXPECT_FALSE(control.own_look()) << "what is drawn is what all see";
  EXPECT_THAT(control.form(false, time_ns).notes, Contains(HasSubstr("everybody sees")));
}

TEST(LookControl, ASliderStaysWhereItWasPutUntilTheServerSaysSomethingElse) {
  LookControl control;
  LookDesc look = sample_look();
  control.follow(scene_with(look), true);
  ASSERT_TRUE(control.edit({{"exposure", 2.0}}, kSInNs));
  ASSERT_TRUE(control.take_assignment(kSInNs));
  const auto exposure = [&](int64_t time_ns) {
    const FormState form = control.form(false, time_ns);
    return std::get<double>(field_of(form.fields, "exposure").value);
  };
  EXPECT_EQ(exposure(kSInNs + 1), 2.0);
  look.ambient = 0.75f;
  control.follow(scene_with(look), true);
  EXPECT_EQ(exposure(kSInNs + 1), 2.0) << "a change of somebody else on its way";
  EXPECT_EQ(control.shown(kSInNs + 1).ambient, 0.75f);
  EXPECT_EQ(exposure(kSInNs + kLookHoldNs), sample_look().exposure)
      << "it was refused, or changed by another";
  // What could not be sent goes with the next.
  ASSERT_TRUE(control.edit({{"exposure", 3.0}}, 5 * kSInNs));
  ASSERT_TRUE(control.take_assignment(5 * kSInNs));
  control.put_back();
  EXPECT_EQ(control.take_assignment(6 * kSInNs), "look={ exposure: 3 }");
}

TEST(LookControl, WhoOnlyWatchesSeesALookOfTheirOwn) {
  LookControl control;
  control.follow(scene_with(sample_look()), false);
  EXPECT_THAT(control.form(false, kSInNs).notes, Contains(HasSubstr("you alone see")));
  EXPECT_TRUE(control.form(false, kSInNs).undo.empty());
  ASSERT_TRUE(control.edit({{"hair_color", std::string("grey")}}, kSInNs));
  EXPECT_FALSE(control.take_assignment(kSInNs)) << "nothing goes to the server";
  ASSERT_TRUE(control.own_look());
  EXPECT_EQ(control.own_look()->hair_color, "grey");
  EXPECT_EQ(control.own_look()->exposure, sample_look().exposure);
  const FormState form = control.form(true, kSInNs);
  EXPECT_THAT(form.notes, Contains(HasSubstr("Nobody else")));
  EXPECT_THAT(form.notes, Contains(HasSubstr("the server's pictures")));
  EXPECT_THAT(form.save_note, HasSubstr("Look and view alone"));
  ASSERT_FALSE(form.undo.empty());
  control.undo();
  EXPECT_FALSE(control.own_look());
  EXPECT_EQ(control.shown(kSInNs), sample_look());
}

TEST(LookControl, NonsenseIsRefusedInOneSentenceAndTheRestCounts) {
  for (const bool is_steering : {true, false}) {
    LookControl control;
    control.follow(scene_with(sample_look()), is_steering);
    const Status status = control.edit(
        {{"hair_color", std::string("purple")}, {"exposure", 2.0}, {"light_direction", glm::vec3(0.0f)}},
        kSInNs);
    ASSERT_FALSE(status);
    EXPECT_THAT(status.error().to_string(), HasSubstr("look.hair_color must be"));
    EXPECT_EQ(control.shown(kSInNs).exposure, 2.0f);
    EXPECT_EQ(control.shown(kSInNs).hair_color, sample_look().hair_color);
    EXPECT_EQ(control.shown(kSInNs).light_direction, sample_look().light_direction);
  }
}

TEST(SaveScene, KeepsWhatTheViewerDoesNotKnowOfTheScene) {
  SceneDesc running = built_in_scene();
  running.solver.name = "pbd";
  running.wind.seed = 17;
  const auto whole = scene_of(SceneText{to_line(running)}, sample_look(), sample_camera());
  ASSERT_TRUE(whole) << whole.error().to_string();
  running.look = sample_look();
  running.camera = sample_camera();
  EXPECT_EQ(*whole, running);
  EXPECT_FALSE(scene_of(SceneText{"no scene"}));

  const TemporaryFolder folder;
  const auto file = folder.path() / "a" / "b.textproto";
  ASSERT_TRUE(save_scene(file, to_text(*whole)));
  const auto loaded = load_scene(file, {});
  ASSERT_TRUE(loaded) << loaded.error().to_string();
  EXPECT_EQ(*loaded, running);
  // Over a scene, but over nothing else.
  EXPECT_TRUE(save_scene(file, to_text(*whole)));
  const auto notes = folder.path() / "notes.txt";
  std::ofstream(notes) << "remember the milk";
  const auto refused = save_scene(notes, to_text(*whole));
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().to_string(), testing::HasSubstr("is no scene: it stays as it is"));
  EXPECT_EQ(std::filesystem::file_size(notes), 17u);
  EXPECT_FALSE(save_scene({}, "x"));
  EXPECT_FALSE(save_scene(file / "below a file", "x"));
}

/// The sample after what a viewer sends.
Result<LookDesc> change_of(const std::string& assignment) {
  SceneDesc scene;
  scene.look = sample_look();
  ASSIGN_OR_RETURN(const SceneDesc changed, with_overrides(scene, {assignment}));
  return changed.look;
}

/// Dear ImGui without a window, and a pointer.
class FormBench {
 public:
  FormBench() {
    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr;
    set_panel_style(1.0f);
    ImGui::GetIO().Fonts->Build();
  }
  ~FormBench() { ImGui::DestroyContext(); }
  FormBench(const FormBench&) = delete;
  FormBench& operator=(const FormBench&) = delete;

  PanelSize turn(const FormState& form, FormActions& actions, const ImVec2& area = {1280.0f, 720.0f}) {
    PanelSize size;
    ImGui::GetIO().DisplaySize = area;
    ImGui::NewFrame();
    size = draw_form_panel(form, actions);
    ImGui::EndFrame();
    return size;
  }
  /// As the window draws it: twice for each picture.
  FormActions picture(const FormState& form) {
    FormActions actions;
    for (int i = 0; i < 2; ++i) turn(form, actions);
    return actions;
  }
};

TEST(FormPanel, StaysInsideTheWindowWhateverItsSize) {
  LookControl control;
  control.follow(scene_with(sample_look()), false);
  FormBench bench;
  FormActions actions;
  for (const ImVec2 area : {ImVec2{1280.0f, 720.0f}, ImVec2{320.0f, 240.0f}, ImVec2{16.0f, 16.0f}}) {
    PanelSize size;
    for (int i = 0; i < 3; ++i) size = bench.turn(control.form(true, kSInNs), actions, area);
    EXPECT_LE(size.width, area.x);
    EXPECT_LE(size.height, std::max(area.y - ImGui::GetFontSize(), 0.0f)) << "with a margin";
  }
  EXPECT_TRUE(actions.is_empty()) << "nobody touched it";
}

// Drags and clicks all over the panel, from below, so that a section that opens moves nothing that comes
// later.
TEST(FormPanel, AnEditIsWhatThePersonTurned) {
  LookControl control;
  control.follow(scene_with(sample_look()), true);
  FormBench bench;
  bench.picture(control.form(false, kSInNs));
  ImGuiIO& io = ImGui::GetIO();
  std::set<std::string> turned;
  int64_t time_ns = kSInNs;
  const auto turn = [&](const ImVec2& pointer, bool is_down) {
    io.MousePos = pointer;
    io.MouseDown[0] = is_down;
    time_ns += kSInNs / 60;
    const FormState form = control.form(false, time_ns);
    const FormActions done = bench.picture(form);
    for (const FormEdit& edit : done.edits) {
      turned.insert(edit.path);
      EXPECT_FALSE(field_of(form.fields, edit.path).is_idle) << edit.path;
    }
    if (done.wants_save) turned.insert("save");
    EXPECT_TRUE(control.edit(done.edits, time_ns));
  };
  for (float y = 700.0f; y > 0.0f; y -= 3.0f)
    for (const float x : {960.0f, 1150.0f}) {
      turn({x, y}, false);
      turn({x, y}, true);
      turn({x + 20.0f, y}, true);
      turn({x + 20.0f, y}, false);
    }
  // A preset has the colour of roots and tips; sections that are folded show nothing to turn.
  EXPECT_EQ(turned, (std::set<std::string>{"background", "skin_color", "save"}));
  const auto assignment = control.take_assignment(time_ns + kSInNs);
  ASSERT_TRUE(assignment);
  EXPECT_THAT(*assignment, testing::AllOf(HasSubstr("background {"), HasSubstr("skin_color {")));
  const auto changed = change_of(*assignment);
  ASSERT_TRUE(changed) << changed.error().to_string();
  LookDesc expected = sample_look();
  expected.background = changed->background;
  expected.skin_color = changed->skin_color;
  EXPECT_EQ(*changed, expected) << "and nothing else";
  EXPECT_NE(changed->background, sample_look().background);
}

std::vector<ParameterInfo> listed_sliders() {
  return {
      {"quality", "auto", "auto", "", false, 0.0, 0.0, true, "known: auto, fast, full, custom; fast runs"},
      {"hair.length", "1", "1", "of its length", true, 0.3, 1.5, false, "only at the start"},
      {"hair.stiffness", "1", "1", "times as stiff", true, 0.1, 10.0, true,
       "how strongly hair keeps its style"},
      {"hair.wind", "0.5", "1", "of the wind", true, 0.0, 3.0, true, "0 = still air"},
      {"look.ambient", "0.2", "0.22", "", true, 0.0, 1.0, true, "none of them"}};
}

TEST(HairSliders, AreWhatTheServerListsAndCanChange) {
  HairSliders sliders;
  sliders.follow(listed_sliders(), true);
  const std::vector<FormField> fields = sliders.fields(0);
  ASSERT_EQ(fields.size(), 3u);
  EXPECT_EQ(fields[0].title, "Quality");
  EXPECT_EQ(fields[0].choices, (std::vector<std::string>{"fast", "auto", "full"}));
  EXPECT_EQ(fields[1].title, "Stiffness");
  EXPECT_TRUE(fields[1].is_logarithmic);
  EXPECT_EQ(fields[2].value, FormValue(0.5));
  EXPECT_EQ(fields[2].usual, FormValue(1.0));
  EXPECT_FALSE(fields[2].is_logarithmic);
  for (const FormField& field : fields) EXPECT_TRUE(field.section.empty() && !field.is_idle) << field.path;
  EXPECT_EQ(sliders.reason(), "");
  sliders.follow(listed_sliders(), false);
  for (const FormField& field : sliders.fields(0)) EXPECT_TRUE(field.is_idle) << field.path;
  EXPECT_THAT(sliders.reason(), HasSubstr("may not steer"));
}

TEST(HairSliders, SayWhatWasMovedOneAfterTheOther) {
  HairSliders sliders;
  sliders.follow(listed_sliders(), true);
  std::vector<FormEdit> edits{
      {"hair.wind", 2.0}, {"ambient", 0.5}, {"quality", std::string("full")}, {"hair.wind", 2.5}};
  sliders.take_edits(edits, kSInNs);
  EXPECT_EQ(edits, (std::vector<FormEdit>{{"ambient", 0.5}})) << "what is not theirs stays";
  EXPECT_EQ(sliders.take_assignment(kSInNs), "hair.wind=2.5") << "the newest alone";
  EXPECT_EQ(sliders.take_assignment(kSInNs + kLookSendNs / 2), std::nullopt) << "not too often";
  EXPECT_EQ(sliders.take_assignment(kSInNs + kLookSendNs), "quality=full");
  EXPECT_EQ(sliders.take_assignment(kSInNs + 2 * kLookSendNs), std::nullopt);
  // It stays where it was put until the server says something else.
  EXPECT_EQ(sliders.fields(kSInNs + kLookSendNs).at(2).value, FormValue(2.5));
  EXPECT_EQ(sliders.fields(kSInNs + 2 * kLookHoldNs).at(2).value, FormValue(0.5));
  // Who may not steer moves nothing.
  sliders.follow(listed_sliders(), false);
  edits = {{"hair.wind", 1.0}};
  sliders.take_edits(edits, 9 * kSInNs);
  EXPECT_TRUE(edits.empty());
  EXPECT_EQ(sliders.take_assignment(9 * kSInNs), std::nullopt);
}

// They stand above all else, which is folded below More, and fit into a small window.
TEST(FormPanel, SlidersStandOnTopAndTheRestIsFolded) {
  LookControl control;
  control.follow(scene_with(sample_look()), true);
  HairSliders sliders;
  sliders.follow(listed_sliders(), true);
  FormState form = control.form(false, kSInNs);
  const std::vector<FormField> top = sliders.fields(kSInNs);
  FormBench bench;
  FormActions actions;
  const ImVec2 area{640.0f, 360.0f};
  PanelSize all, folded;
  for (int i = 0; i < 3; ++i) all = bench.turn(form, actions, area);
  form.fields.insert(form.fields.begin(), top.begin(), top.end());
  for (int i = 0; i < 3; ++i) folded = bench.turn(form, actions, area);
  EXPECT_LT(folded.height, 0.7f * all.height) << "all else is closed";
  // A drag along each line turns what stands there.
  ImGuiIO& io = ImGui::GetIO();
  std::vector<FormEdit> done;
  const auto turn = [&](const ImVec2& pointer, bool is_down) {
    io.MousePos = pointer;
    io.MouseDown[0] = is_down;
    for (FormEdit& edit : bench.picture(form).edits) done.push_back(std::move(edit));
  };
  for (float y = 360.0f; y > 0.0f; y -= 3.0f) {
    turn({1150.0f, y}, false);
    turn({1150.0f, y}, true);
    turn({1210.0f, y}, true);
    turn({1210.0f, y}, false);
  }
  std::set<std::string> turned;
  for (const FormEdit& edit : done) turned.insert(edit.path);
  EXPECT_EQ(turned, (std::set<std::string>{"quality", "hair.stiffness", "hair.wind"}));
}

}  // namespace
}  // namespace strandcast::look_form_test
