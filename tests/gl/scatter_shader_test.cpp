// The laws of shading as the GPU computes them, held against the double-precision fibre of
// common/render/scatter.
#include <cmath>
#include <numbers>
#include <random>

#include "common/render/passes/table_textures.h"
#include "common/render/scatter/artist_lobes.h"
#include "common/render/scatter/chiang.h"
#include "common/render/scatter/dual_scattering.h"
#include "common/scene/hair_color.h"
#include "tests/support/shader_probe.h"

namespace strandcast::scatter_shader_test {
namespace {

using scatter::kDegree;
using scatter::StrandView;

constexpr double kWidth = 7.5 * kDegree;
constexpr double kShift = -7.0 * kDegree;

/// A Fibre of one row: tangent | tilt, light | glint, eye | -, colour | -, weights of R, TT, TRT | diffuse.
constexpr const char* kFibre =
    "Fibre fibre;\n"
    "fibre.color = a(3u).xyz;\n"
    "fibre.absorption = fibre_absorption(a(3u).xyz);\n"
    "fibre.lobes = a(4u).xyz;\n"
    "fibre.diffuse = a(4u).w;\n"
    "fibre.width = 7.5 * kDegree;\n"
    "fibre.shift = -7.0 * kDegree;\n"
    "fibre.tilt = a(0u).w;\n"
    "fibre.glint = a(1u).w;\n";

struct Sample {
  StrandView view;
  double tilt = 0.0;
  double glint = 0.6;
  glm::dvec3 color{0.5};
};

std::vector<glm::vec4> row_of(const Sample& sample, const glm::vec3& lobes, float diffuse = 0.0f) {
  return {glm::vec4(glm::vec3(sample.view.tangent), sample.tilt),
          glm::vec4(glm::vec3(sample.view.to_light), sample.glint),
          glm::vec4(glm::vec3(sample.view.to_eye), 0.0f), glm::vec4(glm::vec3(sample.color), 0.0f),
          glm::vec4(lobes, diffuse)};
}

glm::dvec3 at_angle(double degrees) {
  return {std::cos(degrees * kDegree), std::sin(degrees * kDegree), 0.0};
}

/// Models by the name that scenes use, with what one unit of a lobe is multiplied by in their files.
struct Model {
  const char* name;
  const char* weights;
};
constexpr Model kModels[] = {{"sadeghi", "vec3(kLobeR, kLobeTT, kLobeTRT)"},
                             {"kajiya_kay", "vec3(kWhiteHighlight, 1.0, kTintedHighlight)"},
                             {"karis", "(kLightOfWhite * kKarisWeights)"},
                             {"chiang", "(kLightOfWhite * kChiangWeights)"},
                             {"marschner", "(kLightOfWhite * kMarschnerWeights)"}};

class ScatterShader : public ShaderProbe {
 protected:
  static std::vector<std::string> includes_of(const std::string& model) {
    std::vector<std::string> includes{"lib/fibre.glsl", "lib/scatter_" + model + ".glsl"};
    if (model == "marschner") includes.insert(includes.begin() + 1, "render/lobe_tables.glsl");
    return includes;
  }
  /// Makes and binds what the law reads beside its arguments.
  Prepare tables_of(const std::string& model) {
    if (model != "marschner" && model != "dual") return {};
    lobes_.make({});
    averages_.make({});
    return [this, model](const gl::Program& program) {
      lobes_.longitudinal().bind(0);
      lobes_.azimuthal().bind(1);
      averages_.averages().bind(2);
      if (model == "marschner") {
        program.set("u_longitudinal_table", 0);
        program.set("u_azimuthal_table", 1);
      } else {
        program.set("u_average_table", 2);
      }
    };
  }
  /// The whole law; divided by its weights when `is_plain`.
  std::vector<glm::vec4> scatter(const Model& model, const Rows& rows, bool is_plain = false) {
    const std::string name = model.name;
    std::string body =
        std::string(kFibre) + "vec3 value = scatter_" + name + "(a(0u).xyz, a(1u).xyz, a(2u).xyz, fibre);\n";
    if (is_plain) body += std::string("value /= dot(fibre.lobes, ") + model.weights + ");\n";
    return evaluate(includes_of(name), body + "return vec4(value, 0.0);\n", rows, tables_of(name));
  }

  /// Directions all over the sphere, none of them nearly along the strand, where there is no azimuth.
  static std::vector<Sample> random_samples(size_t count) {
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    const auto direction = [&] {
      return glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
    };
    std::vector<Sample> samples;
    while (samples.size() < count) {
      Sample sample;
      sample.view = {direction(), direction(), direction()};
      if (std::abs(glm::dot(sample.view.tangent, sample.view.to_light)) > 0.98 ||
          std::abs(glm::dot(sample.view.tangent, sample.view.to_eye)) > 0.98)
        continue;
      sample.tilt = 5.0 * kDegree * (2.0 * unit(random) - 1.0);
      sample.glint = (30.0 + 15.0 * unit(random)) * kDegree;
      sample.color = {0.05 + 0.9 * unit(random), 0.05 + 0.9 * unit(random), 0.01 + 0.9 * unit(random)};
      samples.push_back(sample);
    }
    return samples;
  }

  /// Compares every lobe of a law with its equations: within `share` of the lobe's peak, or of its value.
  void expect_lobes(const Model& model, const std::vector<Sample>& samples,
                    const std::function<std::array<glm::dvec3, 3>(const Sample&)>& truth, double share) {
    std::vector<std::array<glm::dvec3, 3>> expected;
    std::array<double, 3> peak{};
    for (const Sample& sample : samples) {
      expected.push_back(truth(sample));
      for (size_t p = 0; p < 3; ++p)
        for (int c = 0; c < 3; ++c) peak[p] = std::max(peak[p], expected.back()[p][c]);
    }
    for (size_t p = 0; p < 3; ++p) {
      if (peak[p] == 0.0) continue;
      glm::vec3 lobes(0.0f);
      lobes[static_cast<int>(p)] = 1.0f;
      Rows rows;
      for (const Sample& sample : samples) rows.push_back(row_of(sample, lobes));
      const auto values = scatter(model, rows, true);
      double worst = 0.0;
      for (size_t i = 0; i < samples.size(); ++i)
        for (int c = 0; c < 3; ++c)
          worst = std::max(worst, std::abs(double{values[i][c]} - expected[i][p][c]) / peak[p]);
      EXPECT_LT(worst, share) << model.name << ", lobe " << p << " with its peak at " << peak[p];
      RecordProperty(std::string(model.name) + "_lobe_" + std::to_string(p), std::to_string(worst));
    }
  }

  LobeTables lobes_;
  ScatterTables averages_;
};

TEST_F(ScatterShader, FresnelAndAbsorptionAreThoseOfTheFibre) {
  Rows rows;
  for (int i = 0; i <= 100; ++i) rows.push_back({glm::vec4(0.01 * i, 0.01 + 0.0099 * i, 0.5, 0.02)});
  const auto values = evaluate({"lib/fibre.glsl"},
                               "return vec4(hair_fresnel(a(0u).x), fibre_absorption(a(0u).yzw));\n", rows);
  for (int i = 0; i <= 100; ++i) {
    const glm::vec4& in = rows[static_cast<size_t>(i)][0];
    EXPECT_NEAR(values[i].x, scatter::fresnel(scatter::kHairIndex, in.x), 1e-5);
    const glm::dvec3 expected = absorption_of_color(glm::dvec3(in.y, in.z, in.w));
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(values[i][c + 1], expected[c], 1e-4 * expected[c] + 1e-6);
  }
}

TEST_F(ScatterShader, KajiyaKayHasItsPublishedValues) {
  // T.L = cos 60, p = 20: T.V = cos 120 is the mirror direction, 10 degrees off it is cos^20 of 10 degrees.
  const auto row = [&](double eye) {
    return std::vector<glm::vec4>{glm::vec4(1, 0, 0, 0), glm::vec4(glm::vec3(at_angle(60)), 0),
                                  glm::vec4(glm::vec3(at_angle(eye)), 0)};
  };
  const auto values = evaluate({"lib/scatter_kajiya_kay.glsl"},
                               "return vec4(kajiya_kay_specular(a(0u).xyz, a(1u).xyz, a(2u).xyz, 20.0),\n"
                               "            kajiya_kay_diffuse(a(0u).xyz, a(1u).xyz), 0.0, 0.0);\n",
                               {row(120), row(110), row(60)});
  EXPECT_NEAR(values[0].x, 1.0, 1e-4);
  EXPECT_NEAR(values[1].x, 0.736257, 1e-4);
  EXPECT_NEAR(values[2].x, 1e-6, 1e-6);
  EXPECT_NEAR(values[0].y, 0.866025, 1e-5);
}

TEST_F(ScatterShader, KajiyaKaysHighlightsAreTheTurnedCones) {
  const double power = 0.25 / (kWidth * kWidth);
  expect_lobes(
      kModels[1], random_samples(4096),
      [&](const Sample& s) {
        const double white = scatter::turned_highlight(s.view, 2.0 * kShift - 2.0 * s.tilt, power);
        const double tinted =
            scatter::turned_highlight(s.view, -3.0 * kShift - 2.0 * s.tilt, power * 11.8 / 14.4);
        return std::array<glm::dvec3, 3>{glm::dvec3(white), glm::dvec3(0.0), tinted * s.color};
      },
      1e-3);
}

TEST_F(ScatterShader, KajiyaKaysHighlightsPeakAtTheirAngles) {
  // With the cone angle of TressFX, 10 degrees: light straight across, the peaks at 110 and at 60 degrees.
  Rows rows;
  for (int degrees = 0; degrees <= 180; ++degrees)
    rows.push_back(
        {glm::vec4(1, 0, 0, 0), glm::vec4(0, 1, 0, 0), glm::vec4(glm::vec3(at_angle(degrees)), 0)});
  const auto values = evaluate(
      {"lib/scatter_kajiya_kay.glsl"},
      "float cone = 10.0 * kDegree;\n"
      "return vec4(turned_highlight(a(0u).xyz, a(1u).xyz, a(2u).xyz, kTurnWhite * cone, 14.4),\n"
      "            turned_highlight(a(0u).xyz, a(1u).xyz, a(2u).xyz, kTurnTinted * cone, 11.8), 0.0, 0.0);\n",
      rows);
  for (int degrees = 0; degrees <= 180; ++degrees) {
    EXPECT_LE(values[degrees].x, values[110].x);
    EXPECT_LE(values[degrees].y, values[60].y);
  }
  EXPECT_NEAR(values[110].x, 1.0, 1e-4);
  EXPECT_NEAR(values[60].y, 1.0, 1e-4);
}

TEST_F(ScatterShader, SadeghisLobesMatchTheEquationsEverywhere) {
  expect_lobes(
      kModels[0], random_samples(4096),
      [&](const Sample& s) {
        scatter::ArtistLobes lobes;
        lobes.shapes = scatter::lobe_shapes(kWidth, kShift);
        lobes.glint_phi = s.glint;
        auto angles = scatter::angles_of(s.view);
        // The strand's own tilt turns the half angle alone.
        const double cos_diff = std::cos(0.5 * (angles.theta_out - angles.theta_in));
        angles.theta_in += s.tilt;
        angles.theta_out += s.tilt;
        EXPECT_NEAR(std::cos(0.5 * (angles.theta_out - angles.theta_in)), cos_diff, 1e-12);
        const auto values = scatter::sadeghi_lobes(lobes, angles);
        return std::array<glm::dvec3, 3>{glm::dvec3(values[0]), values[1] * glm::sqrt(s.color),
                                         values[2] * s.color};
      },
      5e-3);
}

TEST_F(ScatterShader, ThePrimaryHighlightIsShiftedTowardsTheRoot) {
  // Light straight across. At half angle h the lobe is exp(-(h - shift)^2 / 2 width^2) / cos^2 h, with its
  // peak at h - shift = 2 width^2 tan h: -7.25 degrees for R (towards the root), 12.2 degrees for TRT. Twice
  // that is the view.
  Rows rows;
  for (const glm::vec3 lobe : {glm::vec3(1, 0, 0), glm::vec3(0, 0, 1)})
    for (int degrees = -60; degrees <= 60; ++degrees)
      rows.push_back(
          row_of({{{1, 0, 0}, {0, 1, 0}, {std::sin(degrees * kDegree), std::cos(degrees * kDegree), 0}},
                  0.0,
                  35.0 * kDegree},
                 lobe));
  const auto values = scatter(kModels[0], rows);
  const auto peak = [&](size_t first) {
    size_t best = 0;
    for (size_t i = 0; i <= 120; ++i)
      if (values[first + i].x > values[first + best].x) best = i;
    return static_cast<int>(best) - 60;
  };
  EXPECT_NEAR(peak(0), -14.5, 1);
  EXPECT_NEAR(peak(121), 24.4, 1);
}

// Whatever the model, light straight across is reflected 14 degrees towards the root, twice the shift, and a
// strand whose scales are tilted by more sends it further by twice that.
TEST_F(ScatterShader, EveryModelReflectsToTheSamePlace) {
  constexpr int kFrom = -60, kCount = 121;
  for (const Model& model : kModels)
    for (const double tilt : {0.0, 5.0}) {
      Rows rows;
      for (int degrees = kFrom; degrees < kFrom + kCount; ++degrees)
        rows.push_back(
            row_of({{{1, 0, 0}, {0, 1, 0}, {std::sin(degrees * kDegree), std::cos(degrees * kDegree), 0}},
                    tilt * kDegree},
                   glm::vec3(1, 0, 0)));
      const auto values = scatter(model, rows);
      int peak = 0;
      for (int i = 0; i < kCount; ++i)
        if (values[i].x > values[peak].x) peak = i;
      EXPECT_NEAR(peak + kFrom, -14.0 - 2.0 * tilt, 2.0) << model.name;
    }
}

TEST_F(ScatterShader, KarisFitsMatchTheirEquationsEverywhere) {
  expect_lobes(
      kModels[2], random_samples(4096),
      [&](const Sample& s) {
        const auto angles = scatter::angles_of(s.view);
        const auto lobes = scatter::karis_azimuthal(
            s.color, std::max(std::cos(0.5 * (angles.theta_out - angles.theta_in)), 0.02),
            std::cos(angles.phi), glm::dot(s.view.to_light, s.view.to_eye));
        const double sines = std::sin(angles.theta_in) + std::sin(angles.theta_out) + 2.0 * s.tilt;
        const auto along = [&](double width, double shift) {
          return scatter::gaussian(width * 2.0 * kWidth, sines - shift * 2.0 * kShift);
        };
        return std::array<glm::dvec3, 3>{glm::dvec3(along(1.0, 1.0) * lobes.r), along(0.5, -0.5) * lobes.tt,
                                         along(2.0, -2.0) * lobes.trt};
      },
      2e-3);
}

// Half-float tables, filtered: within 1 % of the peak of each lobe over 100,000 directions, colours and
// tilts.
TEST_F(ScatterShader, MarschnersTablesAreTheFibreWithinOnePercentOfThePeak) {
  const auto shapes = scatter::lobe_shapes(kWidth, kShift);
  expect_lobes(
      kModels[4], random_samples(100'000),
      [&](const Sample& s) {
        const auto angles = scatter::angles_of(s.view);
        const glm::dvec3 absorption = absorption_of_color(s.color);
        const double diff = 0.5 * (angles.theta_out - angles.theta_in);
        const double half = 0.5 * (angles.theta_in + angles.theta_out) + s.tilt;
        const double scale = std::cos(angles.theta_in) / std::pow(std::cos(diff), 2.0);
        const scatter::SmoothFibre fibre;
        const auto tt = scatter::azimuthal_ways(1, fibre, diff, angles.phi);
        const auto trt = scatter::azimuthal_trt_ways(fibre, diff, angles.phi);
        std::array<glm::dvec3, 3> lobes{};
        lobes[0] = glm::dvec3(scatter::longitudinal(shapes[0], half) *
                              scatter::azimuthal(0, fibre, diff, angles.phi));
        for (int c = 0; c < 3; ++c) {
          lobes[1][c] = scatter::longitudinal(shapes[1], half) * scatter::sum_of(tt, absorption[c]);
          lobes[2][c] = scatter::longitudinal(shapes[2], half) * scatter::sum_of(trt, absorption[c]);
        }
        for (glm::dvec3& lobe : lobes) lobe *= scale;
        return lobes;
      },
      0.01);
}

// The same at every listed angle of the plain model: N of R and TT straight across, without absorption.
TEST_F(ScatterShader, MarschnersTablesHaveTheListedValues) {
  const std::vector<double> phis{30, 60, 90, 120, 150, 170, 180};
  const std::vector<double> r{.011255, .010423, .010127, .012168, .016942, .013460, 0};
  const std::vector<double> tt{0, 0, .003441, .106322, .371039, .630014, .687957};
  Rows rows;
  for (const double phi : phis) rows.push_back({glm::vec4(phi * kDegree, 1.0, 0.0, 0.0)});
  const auto values =
      evaluate({"render/lobe_tables.glsl"}, "return vec4(table_azimuthal(a(0u).x, a(0u).y, a(0u).z), 0.0);\n",
               rows, [&](const gl::Program& program) {
                 lobes_.make({});
                 lobes_.azimuthal().bind(1);
                 program.set("u_azimuthal_table", 1);
               });
  for (size_t i = 0; i < phis.size(); ++i) {
    EXPECT_NEAR(values[i].x, r[i], 0.01 * .0465) << phis[i];
    EXPECT_NEAR(values[i].y, tt[i], 0.01 * .687957) << phis[i];
  }
}

// 24 entries across the fibre against all of them.
TEST_F(ScatterShader, ChiangsFibreIsTheReferenceWithinOnePercentOfThePeak) {
  scatter::RoughFibre fibre;
  expect_lobes(
      kModels[3], random_samples(3000),
      [&](const Sample& s) {
        const auto angles = scatter::angles_of(s.view);
        const glm::dvec3 absorption = absorption_of_color(s.color);
        const double variance = 4.0 * kWidth * kWidth, tilt = -kShift;
        const double scale = scatter::azimuthal_scale(0.3);
        const double in = angles.theta_in + 2.0 * s.tilt, out = angles.theta_out;
        const std::array<double, 4> along{scatter::rough_longitudinal(variance, in + 2.0 * tilt, out),
                                          scatter::rough_longitudinal(0.25 * variance, in - tilt, out),
                                          scatter::rough_longitudinal(4.0 * variance, in - 4.0 * tilt, out),
                                          scatter::rough_longitudinal(4.0 * variance, in, out)};
        const double index = scatter::bravais_indices(scatter::kHairIndex, out).perpendicular;
        std::array<glm::dvec3, 3> lobes{};
        constexpr int kEntries = 200;
        for (int i = 0; i < kEntries; ++i) {
          const double gamma = std::numbers::pi * ((i + 0.5) / kEntries - 0.5), h = std::sin(gamma);
          const double weight = 0.5 * std::numbers::pi / kEntries * std::cos(gamma);
          for (int c = 0; c < 3; ++c) {
            const auto shares = scatter::lobe_shares({scatter::kHairIndex, out, h, absorption[c]});
            for (size_t p = 0; p < 4; ++p) {
              const double across =
                  p < 3 ? scatter::trimmed_logistic(
                              scale, scatter::wrapped(angles.phi - scatter::exit_azimuth(p, index, h)))
                        : 0.5 / std::numbers::pi;
              lobes[std::min<size_t>(p, 2)][c] += weight * along[p] * across * shares[p];
            }
          }
        }
        return lobes;
      },
      0.01);
}

// The white furnace on the GPU: all directions of the light for one eye, a fibre that absorbs nothing.
TEST_F(ScatterShader, AWhiteFibreVanishesInAWhiteFurnace) {
  constexpr int kInclinations = 200, kAzimuths = 200;
  Rows rows;
  std::vector<double> solid_angle;
  for (int i = 0; i < kInclinations; ++i)
    for (int j = 0; j < kAzimuths; ++j) {
      const double in = std::numbers::pi * ((i + 0.5) / kInclinations - 0.5),
                   phi = 2.0 * std::numbers::pi * (j + 0.5) / kAzimuths;
      Sample sample;
      sample.color = glm::dvec3(1.0);
      sample.view = {{1, 0, 0},
                     {std::sin(in), std::cos(in) * std::cos(phi), std::cos(in) * std::sin(phi)},
                     {std::sin(0.3), std::cos(0.3), 0}};
      rows.push_back(row_of(sample, glm::vec3(1.0f)));
      solid_angle.push_back(2.0 * std::numbers::pi * std::numbers::pi / (kInclinations * kAzimuths) *
                            std::cos(in));
    }
  const auto values =
      evaluate(includes_of("chiang"),
               std::string(kFibre) +
                   "fibre.lobes = 1.0 / (kLightOfWhite * kChiangWeights);\n"
                   "fibre.shift = 0.0;\n"
                   "return vec4(scatter_chiang(a(0u).xyz, a(1u).xyz, a(2u).xyz, fibre), 0.0);\n",
               rows);
  double sum = 0.0;
  for (size_t i = 0; i < rows.size(); ++i) sum += values[i].x * solid_angle[i];
  // Without tilt of the scales, which the model does not normalise for.
  EXPECT_NEAR(sum, 1.0, 0.01);
}

TEST_F(ScatterShader, DualScatteringFollowsItsEquations) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Rows rows;
  std::vector<scatter::FibreAverages> means;
  for (int i = 0; i < 512; ++i) {
    const double forward = 0.02 + 0.8 * unit(random);
    means.push_back({forward, (0.99 - forward) * unit(random), 0.2 * unit(random), 0.2 * unit(random) - 0.2,
                     0.03 + 0.2 * unit(random), 0.03 + 0.2 * unit(random)});
    const auto& m = means.back();
    rows.push_back({glm::vec4(m.forward, m.back, m.forward_shift, m.back_shift),
                    glm::vec4(m.forward_width, m.back_width, 2.0 * unit(random) - 1.0, 0.05 * unit(random))});
  }
  const auto values =
      evaluate({"lib/fibre.glsl", "render/lobe_tables.glsl", "lib/dual_scattering.glsl"},
               "FibreAverages m = FibreAverages(vec3(a(0u).x), vec3(a(0u).y), vec3(a(0u).z), vec3(a(0u).w),\n"
               "                                vec3(a(1u).x), vec3(a(1u).y));\n"
               "BackScatter back = back_scatter(m);\n"
               "return vec4(back.albedo.x, back.shift.x, back.width.x, back_lobe(back, a(1u).z, 0.8, "
               "vec3(a(1u).w)).x);\n",
               rows);
  for (size_t i = 0; i < rows.size(); ++i) {
    const auto back = scatter::back_scatter(means[i]);
    const double lobe = scatter::back_lobe(back, rows[i][1].z, 0.8, rows[i][1].w);
    EXPECT_NEAR(values[i].x, back.albedo, 1e-3 * back.albedo + 1e-6);
    EXPECT_NEAR(values[i].y, back.shift, 1e-3 * std::abs(back.shift) + 1e-4);
    EXPECT_NEAR(values[i].z, back.width, 1e-3 * back.width);
    EXPECT_NEAR(values[i].w, lobe, 5e-3 * lobe + 1e-5);
  }
}

TEST_F(ScatterShader, TheTableOfAveragesHoldsTheFibre) {
  const auto shapes = scatter::lobe_shapes(kWidth, kShift);
  Rows rows;
  for (const double theta : {0.0, 0.5, 1.2})
    for (const double absorption : {0.0, 0.05, 0.2, 0.5, 1.0})
      for (const double layer : {0.0, 1.0, 2.0})
        rows.push_back({glm::vec4(std::cos(theta), std::sqrt(absorption), layer, theta)});
  const auto values =
      evaluate({"render/lobe_tables.glsl"}, "return table_averages(a(0u).x, a(0u).y, uint(a(0u).z));\n", rows,
               tables_of("dual"));
  for (size_t i = 0; i < rows.size(); ++i) {
    const scatter::SmoothFibre fibre{scatter::kHairIndex, rows[i][0].y * rows[i][0].y, {}};
    const double theta = rows[i][0].w;
    const auto means = scatter::fibre_averages(fibre, shapes, theta);
    const auto forward = [&](size_t p) { return scatter::forward_azimuthal(p, fibre, theta); };
    const std::array<std::array<double, 4>, 3> expected{
        {{means.forward, means.back, forward(0), forward(1)},
         {forward(2), means.forward_shift / kShift, means.back_shift / kShift, 0.0},
         {means.forward_width / kWidth, means.back_width / kWidth, 0.0, 0.0}}};
    for (int c = 0; c < 4; ++c)
      EXPECT_NEAR(values[i][c], expected[static_cast<size_t>(rows[i][0].z)][static_cast<size_t>(c)], 0.01)
          << "theta " << theta << ", root of absorption " << rows[i][0].y << ", layer " << rows[i][0].z;
  }
}

TEST_F(ScatterShader, DualScatteringIsTheFibresWithinOnePercentOfThePeak) {
  const auto shapes = scatter::lobe_shapes(kWidth, kShift);
  std::mt19937 random(11);
  std::exponential_distribution<double> chance(0.5);
  std::vector<Sample> samples = random_samples(600);
  Rows rows;
  std::vector<glm::dvec3> expected;
  double peak = 0.0;
  for (Sample& sample : samples) {
    sample.tilt = 0.0;
    const double crossed = chance(random), single = 0.3 * chance(random);
    rows.push_back(row_of(sample, glm::vec3(1.0f)));
    rows.back()[1].w = static_cast<float>(single);
    rows.back()[2].w = static_cast<float>(crossed);
    const auto angles = scatter::angles_of(sample.view);
    const glm::dvec3 absorption = absorption_of_color(sample.color);
    expected.emplace_back(0.0);
    for (int c = 0; c < 3; ++c) {
      expected.back()[c] = scatter::dual_scattering({scatter::kHairIndex, absorption[c], {}}, shapes,
                                                    {angles.theta_in, angles.theta_out, crossed, single});
      peak = std::max(peak, expected.back()[c]);
    }
  }
  const auto values =
      evaluate({"lib/fibre.glsl", "render/lobe_tables.glsl", "lib/dual_scattering.glsl"},
               std::string(kFibre) +
                   "ScatterAngles angles = scatter_angles(a(0u).xyz, a(1u).xyz, a(2u).xyz);\n"
                   "return vec4(dual_scattering(angles, fibre, vec3(a(1u).w), a(2u).w), 0.0);\n",
               rows, tables_of("dual"));
  double worst = 0.0;
  for (size_t i = 0; i < rows.size(); ++i)
    for (int c = 0; c < 3; ++c)
      worst = std::max(worst, std::abs(double{values[i][c]} - expected[i][c]) / peak);
  EXPECT_LT(worst, 0.01) << "of the peak " << peak;
  RecordProperty("dual", std::to_string(worst));
}

// In front of the hair a strand has its own light and some from those around; deep in it only what scattered
// on.
TEST_F(ScatterShader, DualScatteringFadesFromTheStrandsOwnLightToThatOfTheCrowd) {
  Rows rows;
  for (const double crossed : {0.0, 1.0, 3.0, 10.0, 40.0})
    for (const double color : {0.05, 0.5, 0.9}) {
      Sample sample;
      sample.color = glm::dvec3(color);
      sample.view = {{1, 0, 0}, {0, 1, 0}, glm::normalize(glm::dvec3(-0.2, 0.3, 1.0))};
      rows.push_back(row_of(sample, glm::vec3(1.0f)));
      rows.back()[2].w = static_cast<float>(crossed);
    }
  const auto values = evaluate({"lib/fibre.glsl", "render/lobe_tables.glsl", "lib/dual_scattering.glsl"},
                               std::string(kFibre) +
                                   "ScatterAngles angles = scatter_angles(a(0u).xyz, a(1u).xyz, a(2u).xyz);\n"
                                   "return vec4(dual_scattering(angles, fibre, vec3(0.0), a(2u).w).x,\n"
                                   "            dual_scattering(angles, fibre, vec3(1.0), a(2u).w).x,\n"
                                   "            mean_transmittance(vec3(0.3), a(2u).w).x, 0.0);\n",
                               rows, tables_of("dual"));
  for (size_t i = 0; i < rows.size(); ++i) {
    const double crossed = rows[i][2].w;
    EXPECT_GE(values[i].x, 0.0f);
    EXPECT_NEAR(values[i].y - values[i].x, std::exp(-crossed), 1e-3)
        << "its own light as often as none was crossed";
    EXPECT_NEAR(values[i].z, scatter::mean_transmittance(0.3, crossed), 1e-4);
  }
  const auto crowd = [&](size_t depth, size_t color) { return values[3 * depth + color].x; };
  for (size_t depth = 0; depth < 5; ++depth) EXPECT_GT(crowd(depth, 2), crowd(depth, 1));
  EXPECT_GT(crowd(2, 2) / crowd(4, 2), 1.0) << "and less gets through more of them";
  EXPECT_GT(crowd(3, 2), 20.0 * crowd(3, 0)) << "black hair lets nothing through";
}

TEST_F(ScatterShader, DensityNormalsAndTheirLightFollowTheEquations) {
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  Rows rows;
  for (int i = 0; i < 1000; ++i)
    rows.push_back({glm::vec4(normal(random), normal(random), normal(random), std::abs(normal(random)))});
  rows.push_back({glm::vec4(0, 0, 0, 1)});
  const auto values =
      evaluate({"lib/isosurface.glsl"},
               "return vec4(density_normal(a(0u).xyz, a(0u).w, vec3(0.0, 1.0, 0.0)), 0.0);\n", rows);
  for (size_t i = 0; i < rows.size(); ++i) {
    const glm::vec4& in = rows[i][0];
    const glm::dvec3 expected = scatter::density_normal(glm::dvec3(glm::vec3(in)), in.w, {0, 1, 0});
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(values[i][c], expected[c], 1e-5) << i;
  }
  // As much light over all directions as Lambert's cosine, however far it wraps around.
  Rows steps;
  constexpr int kSteps = 2000;
  for (int i = 0; i < kSteps; ++i) steps.push_back({glm::vec4(-1.0 + 2.0 * (i + 0.5) / kSteps, 0, 0, 0)});
  const auto light =
      evaluate({"lib/isosurface.glsl"},
               "vec3 n = vec3(0.0, 1.0, 0.0), l = vec3(sqrt(1.0 - a(0u).x * a(0u).x), a(0u).x, 0.0);\n"
               "return vec4(wrapped_diffuse(n, l, 0.0), wrapped_diffuse(n, l, 0.3), 0.0, 0.0);\n",
               steps);
  double lambert = 0.0, wrapped = 0.0;
  for (const glm::vec4& value : light) {
    lambert += value.x * 2.0 / kSteps;
    wrapped += value.y * 2.0 / kSteps;
  }
  EXPECT_NEAR(lambert, 0.5, 1e-3);
  EXPECT_NEAR(wrapped, 0.5, 1e-3);
}

// A model without TRT passes for another colour of hair: each must lose light where that lobe stands.
TEST_F(ScatterShader, EveryModelShowsWhenOneOfItsLobesIsOff) {
  for (const Model& model : kModels) {
    // R towards the root, TT against the light, TRT towards the tip.
    const std::array<glm::dvec3, 3> eyes{
        at_angle(104), glm::dvec3(std::sin(7 * kDegree), -std::cos(7 * kDegree), 0.0), at_angle(69)};
    for (size_t lobe = 0; lobe < 3; ++lobe) {
      if (lobe == 1 && std::string(model.name) == "kajiya_kay") continue;  // it has no TT
      glm::vec3 without(1.0f);
      without[static_cast<int>(lobe)] = 0.0f;
      Sample sample;
      sample.color = {0.8, 0.6, 0.4};
      sample.view = {{1, 0, 0}, {0, 1, 0}, eyes[lobe]};
      const auto values = scatter(model, {row_of(sample, glm::vec3(1.0f)), row_of(sample, without)});
      EXPECT_LT(values[1].x, 0.85f * values[0].x) << model.name << " without lobe " << lobe;
      EXPECT_GE(values[1].x, 0.0f);
    }
  }
}

TEST_F(ScatterShader, DegenerateDirectionsStayFiniteInEveryModel) {
  const glm::dvec3 x(1, 0, 0), y(0, 1, 0);
  Rows rows;
  for (const StrandView& view : {StrandView{x, x, x},
                                 {x, -x, x},
                                 {x, -x, -x},
                                 {x, x, -x},
                                 {x, x, y},
                                 {x, y, x},
                                 {x, y, y},
                                 {x, y, -y}})
    for (const glm::dvec3 color : {glm::dvec3(0.0), glm::dvec3(1.4), glm::dvec3(0.3)}) {
      Sample sample;
      sample.view = view;
      sample.color = color;
      rows.push_back(row_of(sample, glm::vec3(1.0f), 0.7f));
    }
  for (const Model& model : kModels) {
    const auto values = scatter(model, rows);
    for (size_t i = 0; i < rows.size(); ++i)
      for (int c = 0; c < 3; ++c)
        EXPECT_TRUE(std::isfinite(values[i][c]) && values[i][c] >= 0.0f)
            << model.name << ' ' << i << ' ' << values[i][c];
  }
  const auto dual = evaluate({"lib/fibre.glsl", "render/lobe_tables.glsl", "lib/dual_scattering.glsl"},
                             std::string(kFibre) +
                                 "ScatterAngles angles = scatter_angles(a(0u).xyz, a(1u).xyz, a(2u).xyz);\n"
                                 "return vec4(dual_scattering(angles, fibre, vec3(0.2), 2.0), 0.0);\n",
                             rows, tables_of("dual"));
  for (const glm::vec4& value : dual)
    for (int c = 0; c < 3; ++c) EXPECT_TRUE(std::isfinite(value[c]) && value[c] >= 0.0f);
}

}  // namespace
}  // namespace strandcast::scatter_shader_test
