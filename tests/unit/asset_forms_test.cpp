#include "server/net/asset_forms.h"

#include "common/strands/asset/head.h"
#include "common/strands/asset/lattice.h"
#include "common/strands/asset/layout.h"
#include "common/strands/head/head_form.h"
#include "tests/support/sample_asset.h"

namespace strandcast::asset_forms_test {
namespace {

EncodedFramePtr frame_of(const SceneAsset& asset, AssetLayout layout) {
  return make_encoded_frame({.opcode = Opcode::Asset, .sequence = 1}, encode_scene_asset(asset, layout));
}

TEST(AssetForms, AClientGetsNoLayoutThatItDoesNotTake) {
  const SceneAsset asset = sample_asset(12, 4);
  const auto numbers = frame_of(asset, AssetLayout::Numbers), floats = frame_of(asset, AssetLayout::Floats);
  ASSERT_NE(numbers->message, floats->message);
  AssetForms forms;
  for (const uint32_t newest : {2u, 3u, ~0u}) EXPECT_EQ(forms.fit(numbers, newest), numbers) << newest;
  for (const uint32_t newest : {0u, 1u}) {  // 0: a client of before there was a second layout
    const EncodedFramePtr fit = forms.fit(numbers, newest);
    EXPECT_EQ(fit->message, floats->message);
    EXPECT_EQ(forms.fit(numbers, newest), fit) << "translated once";
    EXPECT_EQ(forms.fit(floats, newest), floats);
  }
  const auto other = frame_of(sample_asset(5, 3), AssetLayout::Numbers);
  EXPECT_EQ(forms.fit(other, 0)->message, frame_of(sample_asset(5, 3), AssetLayout::Floats)->message);
  EXPECT_EQ(forms.fit(nullptr, 0), nullptr);
}

TEST(AssetForms, AHeadByItsFormIsTranslatedForEachClient) {
  SceneAsset asset = sample_asset(12, 4);
  round_to_lattice(asset.rest_position_m, kRestStepBits);
  asset.head = as_sent(make_head(HeadForm()));
  const auto form = frame_of(asset, AssetLayout::Form);
  AssetForms forms;
  for (const uint32_t newest : {3u, ~0u}) EXPECT_EQ(forms.fit(form, newest), form) << newest;
  for (const auto layout : {AssetLayout::Numbers, AssetLayout::Floats}) {
    const EncodedFramePtr fit = forms.fit(form, static_cast<uint32_t>(layout));
    EXPECT_EQ(fit->message, frame_of(asset, layout)->message);
    EXPECT_GT(fit->message.size(), 50 * form->message.size());
    EXPECT_EQ(forms.fit(form, static_cast<uint32_t>(layout)), fit) << "translated once";
  }
  EXPECT_EQ(forms.fit(form, 0), forms.fit(form, 1));
}

TEST(AssetForms, WhatCannotBeReadStaysAsItIs) {
  const auto broken = make_encoded_frame({.opcode = Opcode::Asset, .sequence = 1},
                                         std::vector<std::byte>{std::byte{2}, {}, {}, {}, {}});
  EXPECT_EQ(AssetForms().fit(broken, 1), broken);
}

}  // namespace
}  // namespace strandcast::asset_forms_test
