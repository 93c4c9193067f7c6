#include "common/motion/motion_clip.h"

#include <cmath>
#include <complex>
#include <filesystem>
#include <numbers>

#include "common/base/frame_rate.h"
#include "common/motion/bvh.h"
#include "common/motion/motion_file.h"
#include "common/motion/motion_glitches.h"
#include "common/motion/wind_csv.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::motion_test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

TEST(MotionClip, InterpolatesAndClamps) {
  MotionClip clip;
  EXPECT_EQ(clip.sample(1.0), Pose{});
  EXPECT_EQ(clip.duration_s(), 0.0);
  clip.frame_s = 0.5;
  clip.world_from_head = {{{0, 0, 0}, {1, 0, 0, 0}},
                          {{2, 0, 0}, glm::angleAxis(1.0, glm::dvec3(0, 1, 0))},
                          {{2, 4, 0}, glm::angleAxis(1.0, glm::dvec3(0, 1, 0))}};
  EXPECT_EQ(clip.duration_s(), 1.0);
  EXPECT_EQ(clip.sample(-1.0), clip.world_from_head[0]);
  EXPECT_EQ(clip.sample(9.0), clip.world_from_head[2]);
  EXPECT_EQ(clip.sample(std::nan("")), clip.world_from_head[0]);
  EXPECT_NEAR(clip.sample(0.125).position_m.x, 0.5, 1e-12);
  EXPECT_NEAR(angle_between_rad(clip.sample(0.125).rotation, {1, 0, 0, 0}), 0.25, 1e-12);
  EXPECT_NEAR(clip.sample(0.75).position_m.y, 2.0, 1e-12);
}

// As bodies of 3ds Max have it at rest, and files whose X is up altogether.
TEST(UpAxis, MayBeX) {
  const auto clip_of = [](const std::string& row) {
    const std::string text =
        "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Xrotation Yrotation "
        "Zrotation\nJOINT Head\n{\nOFFSET 2 0 0\nCHANNELS 0\nEnd Site\n{\nOFFSET 1 0 "
        "0\n}\n}\n}\nMOTION\nFrames: "
        "1\nFrame Time: .01\n" +
        row + "\n";
    BvhOptions options;
    options.unit_m = 1.0;
    options.recentre = false;
    return parse_bvh(text, "x.bvh", options).value();
  };
  const auto expect_upright = [](const MotionClip& clip) {
    const Pose& pose = clip.world_from_head.front();
    EXPECT_NEAR(pose.position_m.y, 5.0, 1e-12) << "hips, and 2 above them";
    EXPECT_NEAR(glm::distance(pose.rotation * glm::dvec3(0, 1, 0), glm::dvec3(0, 1, 0)), 0.0, 1e-12);
    EXPECT_NEAR(glm::distance(pose.rotation * glm::dvec3(0, 0, 1), glm::dvec3(0, 0, 1)), 0.0, 1e-12);
    EXPECT_THAT(clip.up_reason, HasSubstr("its face is taken to be at +Z there"));
  };
  const MotionClip all = clip_of("3 0 0 0 0 0");
  expect_upright(all);
  EXPECT_THAT(all.up_reason,
              StartsWith("+X is taken as up: there the head is above the hips in the rest pose"));
  const MotionClip at_rest = clip_of("0 3 0 0 0 90");
  expect_upright(at_rest);
  EXPECT_THAT(at_rest.up_reason, StartsWith("+Y is taken as up"));
  EXPECT_THAT(at_rest.up_reason, HasSubstr("in the motion, though +X is up in the rest pose"));
}

TEST(WindSeries, InterpolatesAndClamps) {
  WindSeries series;
  EXPECT_EQ(series.sample(1.0), glm::vec3(0.0f));
  series.time_s = {0.0, 0.1, 1.1};
  series.velocity_mps = {{0, 0, 0}, {1, 0, 0}, {1, 2, 0}};
  EXPECT_EQ(series.duration_s(), 1.1);
  EXPECT_NEAR(series.sample(0.05).x, 0.5f, 1e-6);
  EXPECT_NEAR(series.sample(0.6).y, 1.0f, 1e-6);
  EXPECT_EQ(series.sample(-5.0), series.velocity_mps.front());
  EXPECT_EQ(series.sample(5.0), series.velocity_mps.back());
}

TEST(BuiltInMotion, RepeatsWithoutASeamAndIsTwiceDifferentiable) {
  const double h = 1e-4;
  glm::dvec3 previous_acceleration{0.0};
  double largest_jump = 0.0, largest_acceleration = 0.0;
  for (double t = 0.0; t < kBuiltInMotionPeriodS + 0.1; t += h) {
    // Second differences of a point in front of the face: they see position and rotation.
    const auto point = [](double at_s) { return built_in_motion(at_s) * glm::dvec3(0.02, 0.05, 0.1); };
    const glm::dvec3 acceleration = (point(t + h) - 2.0 * point(t) + point(t - h)) / (h * h);
    if (t > 0.0) largest_jump = std::max(largest_jump, glm::distance(acceleration, previous_acceleration));
    largest_acceleration = std::max(largest_acceleration, glm::length(acceleration));
    previous_acceleration = acceleration;
  }
  // A kink in the velocity would show as ~ 1/h; a step of the acceleration as its size. The quintic's third
  // derivative bounds the change over one h: 60 * 2.2 rad * 0.12 m / (0.35 s)^3 * h = 0.04 m/s^2, and as much
  // again for rounding.
  EXPECT_LT(largest_jump, 0.1);
  EXPECT_GT(largest_acceleration, 5.0) << "there is a fast turn";
  EXPECT_NEAR(
      glm::distance(built_in_motion(0.3).position_m, built_in_motion(0.3 + kBuiltInMotionPeriodS).position_m),
      0.0, 1e-9);
  EXPECT_TRUE(is_finite(built_in_motion(-7.0)));
}

TEST(BuiltInMotion, StaysWithinWhatPeopleDo) {
  double fastest_rad_per_s = 0.0, fastest_mps = 0.0;
  const double h = 1e-3;
  for (double t = 0.0; t < kBuiltInMotionPeriodS; t += h) {
    const Pose a = built_in_motion(t), b = built_in_motion(t + h);
    fastest_rad_per_s = std::max(fastest_rad_per_s, angle_between_rad(a.rotation, b.rotation) / h);
    fastest_mps = std::max(fastest_mps, glm::distance(a.position_m, b.position_m) / h);
    EXPECT_NEAR(glm::length(a.rotation), 1.0, 1e-12);
    EXPECT_NEAR(a.position_m.y, 1.6, 0.1);
  }
  EXPECT_GT(glm::degrees(fastest_rad_per_s), 400.0) << "the fast turn shows the hair off";
  EXPECT_LT(glm::degrees(fastest_rad_per_s), 1200.0) << "motion capture peaks at about 1200 deg/s";
  EXPECT_LT(fastest_mps, 3.0);
}

struct Statistics {
  glm::dvec3 mean{0.0}, deviation{0.0};
};

Statistics statistics_of(const GustGenerator& wind, double duration_s, double step_s) {
  Statistics result;
  glm::dvec3 square{0.0};
  const auto count = static_cast<int>(duration_s / step_s);
  for (int i = 0; i < count; ++i) {
    const glm::dvec3 v = wind.sample(i * step_s);
    result.mean += v;
    square += v * v;
  }
  result.mean /= count;
  result.deviation = glm::sqrt(square / static_cast<double>(count) - result.mean * result.mean);
  return result;
}

TEST(Gusts, MeanAndDeviationAreThoseAskedFor) {
  constexpr double kDurationS = 20'000.0;
  for (const uint32_t seed : {1u, 2u, 77u}) {
    const float speed_mps = 3.0f, intensity = 0.6f, length_m = 9.0f;
    const auto s =
        statistics_of(GustGenerator({speed_mps, 0, 0}, intensity, length_m, seed), kDurationS, 0.3);
    const double deviation = speed_mps * intensity;
    // Standard error of the mean of a process with integral time length/speed, four times.
    const double error = 4.0 * deviation * std::sqrt(2.0 * length_m / speed_mps / kDurationS);
    EXPECT_NEAR(s.mean.x, speed_mps, error);
    EXPECT_NEAR(s.mean.y, 0.0, error);
    EXPECT_NEAR(s.mean.z, 0.0, error);
    // The variance of the same process is known to sqrt(2 * 2 T / duration) of itself (3.5 %), its root to
    // half.
    EXPECT_NEAR(s.deviation.x / deviation, 1.0, 4 * 0.0175);
    EXPECT_NEAR(s.deviation.z / deviation, 0.8, 4 * 0.0175);
    EXPECT_NEAR(s.deviation.y / deviation, 0.5, 4 * 0.0175);
  }
}

TEST(Gusts, StrengthTurnsWithTheMean) {
  const auto s = statistics_of(GustGenerator({0, 0, -2}, 0.5f, 5.0f, 3), 20'000.0, 0.3);
  EXPECT_NEAR(s.deviation.z, 1.0, 0.07);
  EXPECT_NEAR(s.deviation.x, 0.8, 0.07);
  EXPECT_NEAR(s.deviation.y, 0.5, 0.07);
}

/// Energy of the x component between two frequencies, by a windowed Fourier sum.
double band_energy(const GustGenerator& wind, double low_hz, double high_hz) {
  constexpr int kCount = 8192;
  constexpr double kStepS = 1.0 / 32.0;
  std::vector<double> signal(kCount);
  for (int i = 0; i < kCount; ++i) {
    const double hann = 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * i / kCount);
    signal[static_cast<size_t>(i)] = hann * (wind.sample(i * kStepS).x - 3.0);
  }
  double energy = 0.0;
  const double bin_hz = 1.0 / (kCount * kStepS);
  for (int bin = static_cast<int>(low_hz / bin_hz); bin < static_cast<int>(high_hz / bin_hz); ++bin) {
    const auto turn = std::polar(1.0, -2.0 * std::numbers::pi * bin / kCount);
    std::complex<double> phase = 1.0, sum = 0.0;
    for (const double value : signal) {
      sum += value * phase;
      phase *= turn;
    }
    energy += std::norm(sum);
  }
  return energy;
}

TEST(Gusts, SpectrumFallsWithTheFiveThirdsPower) {
  double low = 0.0, high = 0.0;
  for (uint32_t seed = 1; seed <= 6; ++seed) {
    const GustGenerator wind({3, 0, 0}, 0.6f, 9.0f, seed);
    low += band_energy(wind, 1.0, 2.0);
    high += band_energy(wind, 4.0, 8.0);
  }
  // Energy in an octave is density times width: over two octaves the density falls by high/low/4.
  EXPECT_NEAR(std::log2(high / low / 4.0) / 2.0, -5.0 / 3.0, 0.1);
}

/// A head that walks at 1 m/s and turns at 90 degrees/s, 100 frames a second.
MotionClip walk(size_t frame_count) {
  MotionClip clip;
  clip.frame_s = 0.01;
  for (size_t i = 0; i < frame_count; ++i) {
    const double t_s = clip.frame_s * static_cast<double>(i);
    clip.world_from_head.push_back(
        {{t_s, 1.6, 0.0}, glm::angleAxis(glm::radians(90.0 * t_s), glm::dvec3(0, 1, 0))});
  }
  return clip;
}

TEST(MotionGlitches, CountsStepsThatNoHeadMakes) {
  MotionClip clip = walk(100);
  EXPECT_EQ(find_glitches(clip).step_count, 0u);
  EXPECT_NEAR(find_glitches(clip).fastest_mps, 1.0, 1e-9);
  EXPECT_NEAR(find_glitches(clip).fastest_deg_per_s, 90.0, 1e-5);
  clip.world_from_head[40].position_m.z += 0.44;  // 44 m/s, there and back
  clip.world_from_head[70].rotation = glm::angleAxis(glm::radians(60.0), glm::dvec3(1, 0, 0));
  const MotionGlitches glitches = find_glitches(clip);
  EXPECT_EQ(glitches.step_count, 4u);
  EXPECT_NEAR(glitches.first_s, 0.39, 1e-12);
  EXPECT_NEAR(glitches.fastest_mps, std::hypot(44.0, 1.0), 1e-9);
  EXPECT_GT(glitches.fastest_deg_per_s, 6000.0);
}

TEST(MotionGlitches, FilteringLeavesTheRestAndFindsNoneAfterwards) {
  const MotionClip good = walk(100);
  MotionClip clip = good;
  for (const size_t i : {20u, 40u, 41u, 42u, 99u}) clip.world_from_head[i].position_m.z += 5.0;
  clip.world_from_head[70].rotation = glm::angleAxis(glm::radians(150.0), glm::dvec3(1, 0, 0));
  EXPECT_EQ(filter_glitches(clip), 6u);
  EXPECT_EQ(find_glitches(clip).step_count, 0u);
  for (size_t i = 0; i < 99; ++i) {
    EXPECT_NEAR(glm::distance(clip.world_from_head[i].position_m, good.world_from_head[i].position_m), 0.0,
                1e-12)
        << i;
    EXPECT_NEAR(angle_between_rad(clip.world_from_head[i].rotation, good.world_from_head[i].rotation), 0.0,
                1e-7)
        << i;
  }
  EXPECT_EQ(clip.world_from_head[99], clip.world_from_head[98]) << "nothing follows the last one";
}

TEST(MotionGlitches, AJumpThatStaysIsReachedAtTheLimit) {
  MotionClip clip = walk(100);
  for (size_t i = 50; i < 100; ++i) clip.world_from_head[i].position_m.z += 3.0;
  EXPECT_EQ(filter_glitches(clip), 20u) << "3 m at 15 m/s are 0.2 s; the frame that gets there is good";
  EXPECT_EQ(find_glitches(clip).step_count, 0u);
  EXPECT_EQ(clip.world_from_head[99].position_m.z, 3.0);
  MotionClip untouched = walk(100);
  EXPECT_EQ(filter_glitches(untouched), 0u);
}

TEST(Gusts, SameSeedSameWindAndOtherSeedOtherWind) {
  const GustGenerator a({1, 0, 1}, 0.5f, 9.0f, 5), b({1, 0, 1}, 0.5f, 9.0f, 5), c({1, 0, 1}, 0.5f, 9.0f, 6);
  double difference = 0.0;
  for (double t = 0.0; t < 50.0; t += 0.37) {
    EXPECT_EQ(a.sample(t), b.sample(t));
    difference = std::max<double>(difference, glm::distance(a.sample(t), c.sample(t)));
  }
  EXPECT_GT(difference, 0.3);
}

TEST(Gusts, NoMeanOrNoIntensityIsSteady) {
  for (const double t : {0.0, 1.0, 1e6}) {
    EXPECT_EQ(GustGenerator({0, 0, 0}, 0.5f, 9.0f, 1).sample(t), glm::vec3(0.0f));
    EXPECT_EQ(GustGenerator({1, 2, 3}, 0.0f, 9.0f, 1).sample(t), glm::vec3(1, 2, 3));
  }
  const glm::vec3 straight_up = GustGenerator({0, 4, 0}, 0.5f, 9.0f, 1).sample(2.0);
  EXPECT_TRUE(std::isfinite(straight_up.x) && std::isfinite(straight_up.y) && std::isfinite(straight_up.z));
}

std::string wind_error(const std::string& text) {
  const auto series = parse_wind_csv(text, "w.csv");
  return series ? "no error" : series.error().to_string();
}

TEST(WindCsv, ReadsWorldColumnsInAnyOrder) {
  const auto series = parse_wind_csv(
      "\xef\xbb\xbf# made up\n\"z_mps\", t_s ,note,x_mps,y_mps\r\n3,10.5,a,1,2\n\n-3,11,,.5,+2e-1\n",
      "w.csv");
  ASSERT_TRUE(series) << series.error().to_string();
  EXPECT_EQ(series->time_s, (std::vector<double>{0.0, 0.5}));
  EXPECT_EQ(series->velocity_mps[0], glm::vec3(1, 2, 3));
  EXPECT_EQ(series->velocity_mps[1], glm::vec3(0.5f, 0.2f, -3));
}

TEST(WindCsv, ReadsTheLoggersColumns) {
  // 2.63 m/s from 249 degrees: towards east 2.454, towards north 0.945 (the record the format note checks).
  const auto series = parse_wind_csv(
      "logger_ms,gps_utc_hhmmsscc,u,v,w,s2,dir_deg,temp_c\n"
      "512100,12345678,2.454,0.945,0.1,2.63,249,17.5\n512200,12345678,0,-1,0,1,0,17.5\n",
      "w.csv");
  ASSERT_TRUE(series) << series.error().to_string();
  EXPECT_NEAR(series->time_s[1], 0.1, 1e-9);
  EXPECT_EQ(series->velocity_mps[0], glm::vec3(2.454f, 0.1f, -0.945f)) << "north is -z";
  EXPECT_EQ(series->velocity_mps[1], glm::vec3(0, 0, 1)) << "wind from the north blows towards +z";
}

TEST(WindCsv, ErrorsNameLineAndKnownColumns) {
  EXPECT_THAT(wind_error(""), HasSubstr("no header row"));
  EXPECT_THAT(wind_error("t_s,u,v,w\n"), HasSubstr("header but no rows"));
  EXPECT_THAT(wind_error("time,u,v,w\n1,2,3,4\n"), HasSubstr("known: t_s, time_s, logger_ms"));
  EXPECT_THAT(wind_error("t_s,u,v\n1,2,3\n"), HasSubstr("known: x_mps, y_mps, z_mps or u, v, w"));
  EXPECT_THAT(wind_error("t_s,u,v,w\n0,1,2,3\n1,2,3\n"), StartsWith("w.csv:3: the row has 3 values"));
  EXPECT_THAT(wind_error("t_s,u,v,w\n0,1,x,3\n"), StartsWith("w.csv:2: column 3 is \"x\""));
  EXPECT_THAT(wind_error("t_s,u,v,w\n0,1,nan,3\n"), HasSubstr("\"nan\""));
  EXPECT_THAT(wind_error("t_s,u,v,w\n0,1,1e9,3\n"), HasSubstr("\"1e9\""));
  EXPECT_THAT(wind_error("t_s,u,v,w\n0,1,,3\n"), HasSubstr("column 3 is \"\""));
  EXPECT_THAT(wind_error("t_s,u,v,w\n1,0,0,0\n0,0,0,0\n"),
              StartsWith("w.csv:3: time goes back from 1 s to 0 s"));
  EXPECT_THAT(wind_error(std::string(1000, ',')), HasSubstr("more than 256 columns"));
  EXPECT_THAT(wind_error("t_s,u,v,w\n0,1,5,2,3\n1,1,5,2,3\n"), StartsWith("w.csv:2: the row has 5 values"))
      << "decimal commas between commas cannot be told";
  EXPECT_EQ(load_wind_csv("/no/such/file.csv").error().code, ErrorCode::NotFound);
}

WindSeries repaired(const std::string& text) {
  const auto series = parse_wind_csv(text, "w.csv");
  EXPECT_TRUE(series) << series.error().to_string();
  // Zeros where there is nothing, so that a failure is no crash.
  return series ? *series : WindSeries{std::vector<double>(16), std::vector<glm::vec3>(16), {}};
}

using testing::ElementsAre;

TEST(WindCsv, AGoodFileNeedsNoRepair) {
  EXPECT_THAT(repaired("t_s,u,v,w\n0,1,2,3\n0.1,1,2,3\n0.2,1,2,3\n").repairs, testing::IsEmpty())
      << "the same wind at another time repeats nothing";
}

TEST(WindCsv, ReadsSemicolonsAndDecimalCommas) {
  const WindSeries series = repaired("t_s;u;v;w\n0,0;1,5;-2;0,25\n0,5;1;-2,5;,5\n");
  EXPECT_EQ(series.time_s, (std::vector<double>{0.0, 0.5}));
  EXPECT_EQ(series.velocity_mps[0], glm::vec3(1.5f, 0.25f, 2.0f));
  EXPECT_EQ(series.velocity_mps[1], glm::vec3(1.0f, 0.5f, 2.5f));
  EXPECT_THAT(series.repairs,
              ElementsAre("values are separated by semicolons", "6 numbers have a decimal comma"));
  const WindSeries quoted = repaired("t_s,u,v,w\n\"0,0\",\"1,5\",\"-2\",0\n\"0,5\",1,2,3\n");
  EXPECT_EQ(quoted.velocity_mps[0], glm::vec3(1.5f, 0.0f, 2.0f));
  EXPECT_THAT(quoted.repairs, ElementsAre("3 numbers have a decimal comma"));
  EXPECT_THAT(repaired("t_s\tu\tv\tw\n0\t1\t2\t3\n").repairs, ElementsAre("values are separated by tabs"));
}

TEST(WindCsv, LineEndsMakeNoDifference) {
  const std::string text = "# made\nt_s,u,v,w\n0,1,2,3\n1,4,5,6\n";
  const WindSeries expected = repaired(text);
  ASSERT_EQ(expected.time_s.size(), 2u);
  for (const char* const end : {"\r", "\r\n"}) {
    std::string other;
    for (const char c : text) other += c == '\n' ? end : std::string(1, c);
    const WindSeries series = repaired(other);
    EXPECT_EQ(series.time_s, expected.time_s);
    EXPECT_EQ(series.velocity_mps, expected.velocity_mps);
    EXPECT_TRUE(series.repairs.empty());
  }
}

TEST(WindCsv, LeavesOutRowsThatCannotBeReadAndCountsThem) {
  const auto text = [](size_t good) {
    std::string rows =
        "t_s,u,v,w\n0,1,0,0\n0.1,nan,0,0\n0.2,2,0,0\n0.3,,0,0\n0.4,3,0,0\n0.5,-9999,0,0\n0.6,6,0\n";
    for (size_t i = 0; i < good; ++i) rows += fmt::format("{},4,0,0\n", 0.7 + 0.1 * static_cast<double>(i));
    return rows;
  };
  const WindSeries series = repaired(text(33));
  EXPECT_EQ((std::vector(series.time_s.begin(), series.time_s.begin() + 4)),
            (std::vector<double>{0.0, 0.2, 0.4, 0.7}));
  EXPECT_NEAR(series.sample(0.3).x, 2.5f, 1e-6f) << "what is missing is bridged";
  EXPECT_THAT(
      series.repairs.front(),
      "4 of 40 rows cannot be used, and are left out (0 go back in time); the first: w.csv:3: column 2 "
      "is \"nan\", not a number within 150");
  EXPECT_THAT(
      wind_error(text(32)),
      testing::AllOf(StartsWith("w.csv:3: "), HasSubstr("4 of 39 rows cannot be used, a tenth at most")));
}

TEST(WindCsv, LeavesOutRowsThatGoBackAndRepetitions) {
  std::string text = "t_s,u,v,w\n0,1,0,0\n1,2,0,0\n1,2,0,0\n0.5,9,9,9\n";
  for (int i = 2; i < 8; ++i) text += fmt::format("{0},{0},0,0\n", i);
  const WindSeries series = repaired(text);
  EXPECT_EQ(series.time_s, (std::vector<double>{0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0}));
  EXPECT_THAT(series.repairs,
              ElementsAre("1 of 10 rows cannot be used, and are left out (1 go back in time); the first: "
                          "w.csv:5: time goes back from 1 s to 0.5 s",
                          "1 rows left out because they repeat the one before"));
}

TEST(WindCsv, SpreadsRowsThatShareATime) {
  // A clock of whole seconds, four readings in each.
  std::string text = "t_s,u,v,w\n";
  for (int i = 0; i < 12; ++i) text += std::to_string(i / 4) + "," + std::to_string(i) + ",0,0\n";
  const WindSeries series = repaired(text);
  ASSERT_EQ(series.time_s.size(), 12u);
  for (size_t i = 0; i < 12; ++i) {
    EXPECT_DOUBLE_EQ(series.time_s[i], 0.25 * static_cast<double>(i));
    EXPECT_EQ(series.velocity_mps[i].x, static_cast<float>(i));
  }
  EXPECT_THAT(series.repairs,
              ElementsAre("9 rows with the time of the one before, spread evenly up to the next time"));
}

TEST(WindCsv, BridgesGapsAndCountsThem) {
  const WindSeries series = repaired(
      "logger_ms,u,v,w\n100,0,0,0\n200,1,0,0\n300,2,0,0\n1400,13,0,0\n1500,14,0,0\n1800,17,0,0\n1900,18,0,"
      "0\n");
  EXPECT_NEAR(series.sample(0.7).x, 7.0f, 1e-5f);
  EXPECT_THAT(series.repairs,
              ElementsAre("2 gaps, the longest of 1.1 s: the wind goes evenly from one end to the other"));
}

// As cameras have it: the same clip, turned over about +Z, is the same motion.
// As mannequins that look along +Y, avatars along -Z and rigs along +X have it: a nod lowers the face of
// each.
TEST(RestPose, FacesWhereItsLeftAndRightJointsLie) {
  struct Case {
    const char *up, *left, *right, *to_left, *nod;
    glm::dvec3 face;  // in the world
    const char* said;
  };
  for (const Case& item :
       {Case{"0 2 0", "LeftArm", "RightArm", "1 0 0", "30 0 0", {0, 0, 1}, ""},
        {"0 2 0", "LeftArm", "RightArm", "-1 0 0", "-30 0 0", {0, 0, -1}, "its rest pose faces -Z"},
        {"0 0 2", "clavicle_l", "clavicle_r", "-1 0 0", "-30 0 0", {0, 0, -1}, "its rest pose faces -Z"},
        {"0 2 0", "lShldr", "rShldr", "0 0 -1", "0 0 -30", {1, 0, 0}, "its rest pose faces +X"},
        {"0 2 0", "Bip01 L Hand", "Bip01 R Hand", "0 0 1", "0 0 30", {-1, 0, 0}, "its rest pose faces -X"}}) {
    SCOPED_TRACE(item.left + std::string(item.to_left));
    const auto arm = [](const std::string& name, const std::string& offset) {
      return "JOINT " + name + "\n{\nOFFSET " + offset + "\nCHANNELS 0\nEnd Site\n{\nOFFSET 0 0 0\n}\n}\n";
    };
    const std::string text = fmt::format(
        "HIERARCHY\nROOT Hips\n{{\nOFFSET 0 0 0\nCHANNELS 0\n{}{}JOINT Head\n{{\nOFFSET {}\n"
        "CHANNELS 3 Xrotation Yrotation Zrotation\nEnd Site\n{{\nOFFSET 0 0 0\n}}\n}}\n}}\n"
        "MOTION\nFrames: 2\nFrame Time: .01\n0 0 0\n{}\n",
        arm(item.left, item.to_left), arm(item.right, "0 0 0"), item.up, item.nod);
    BvhOptions options;
    options.unit_m = 1.0;
    options.has_body = true;
    const auto clip = parse_bvh(text, "x.bvh", options);
    ASSERT_TRUE(clip) << clip.error().to_string();
    const glm::dvec3 ahead(0, 0, 1), up(0, 1, 0);
    EXPECT_LT(glm::distance(clip->world_from_head[0].rotation * ahead, item.face), 1e-9);
    EXPECT_LT(glm::distance(clip->world_from_head[0].rotation * up, up), 1e-9);
    EXPECT_NEAR((clip->world_from_head[1].rotation * ahead).y, -0.5, 1e-9);
    EXPECT_THAT(clip->facing_reason, StartsWith(item.said));
    EXPECT_EQ(clip->facing_reason.empty(), std::string(item.said).empty());
    if (clip->joint_name.empty()) continue;
    EXPECT_NEAR(clip->joint_m[0].x, 1.0, 1e-9) << "to its left";
  }
}

/// A hip with a head straight above it; `rows`: place of the hips, and rotation about X.
Result<MotionClip> clip_of_two_joints(double bone, const std::vector<std::string>& rows) {
  std::string text = fmt::format(
      "HIERARCHY\nROOT Hips\n{{\nOFFSET 0 0 0\nCHANNELS 4 Xposition Yposition Zposition Xrotation\nJOINT "
      "Head\n{{\nOFFSET 0 {} 0\nCHANNELS 0\nEnd Site\n{{\nOFFSET 0 0 0\n}}\n}}\nJOINT Foot\n{{\nOFFSET 0 -{} "
      "0\nCHANNELS 0\nEnd Site\n{{\nOFFSET 0 0 0\n}}\n}}\n}}\nMOTION\nFrames: {}\nFrame Time: .01\n",
      0.5 * bone, 0.5 * bone, rows.size());
  for (const std::string& row : rows) text += row + "\n";
  return parse_bvh(text, "x.bvh", BvhOptions());
}

TEST(ClipUnit, ChildrenHaveTheCommonUnits) {
  for (const double unit_m : {1e-3, 1e-2, 1.0})
    for (const double body_m : {0.9, 1.11, 1.3})
      EXPECT_EQ(clip_of_two_joints(body_m / unit_m, {"0 0 0 0"})->file_unit_m, unit_m) << body_m;
  EXPECT_NE(clip_of_two_joints(0.7, {"0 0 0 0"})->file_unit_m, 1.0) << "too small for one who walks";
}

// On all fours the head is ahead of the hips, but the floor stays below.
TEST(UpAxis, IsNotWhereSomebodyCrawlsTo) {
  const auto crawl_over = [](double way_m) {
    std::vector<std::string> rows;
    for (int i = 0; i <= 20; ++i) rows.push_back(fmt::format("0 0.4 {} 90", 0.5 + way_m * i / 20.0));
    return clip_of_two_joints(1.7, rows).value();
  };
  const MotionClip crawl = crawl_over(2.7);
  EXPECT_EQ(crawl.up_reason, "");
  for (const Pose& pose : crawl.world_from_head) EXPECT_NEAR(pose.position_m.y, 0.4, 1e-9);
  EXPECT_THAT(crawl_over(0.1).up_reason, StartsWith("+Z is taken as up")) << "who stays there stands";
}

// As a character that is exported beside its own reference pose.
TEST(Performers, TheHeadOfATreeThatMovesIsTaken) {
  const auto tree = [](const char* root) {
    return fmt::format(
        "ROOT {}\n{{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\nJOINT Head\n{{\nOFFSET 0 80 0\n"
        "CHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{{\nOFFSET 0 9 0\n}}\n}}\n}}\n",
        root);
  };
  const auto clip_of = [&](const std::string& rows, const std::string& head_joint) {
    BvhOptions options;
    options.unit_m = 0.01;
    options.recentre = false;
    options.head_joint = head_joint;
    return parse_bvh(
               "HIERARCHY\n" + tree("Bind") + tree("Hips") + "MOTION\nFrames: 2\nFrame Time: .01\n" + rows,
               "x.bvh", options)
        .value();
  };
  const std::string second_moves = "0 90 0 0 0 0 7 90 0 0 0 0\n0 90 0 0 0 0 7 90 0 0 20 0\n";
  const MotionClip clip = clip_of(second_moves, "");
  EXPECT_EQ(clip.world_from_head[0].position_m.x, 0.07);
  EXPECT_THAT(clip.head_reason, AllOf(HasSubstr("the one with Head#2 is taken, others have Head "),
                                      HasSubstr("the first joint of such a name does not move")));
  EXPECT_EQ(clip_of(second_moves, "Head").world_from_head[0].position_m.x, 0.0) << "as asked";
  EXPECT_EQ(
      clip_of("0 90 0 0 0 0 7 90 0 0 0 0\n0 90 0 0 9 0 7 90 0 0 20 0\n", "").world_from_head[0].position_m.x,
      0.0)
      << "both move";
  EXPECT_THAT(clip_of("0 90 0 0 0 0 7 90 0 0 0 0\n0 90 0 0 0 0 7 90 0 0 0 0\n", "").head_reason,
              Not(HasSubstr("does not move")));
}

// Two that hang from one root are two. A hammer's head in a hand is nobody's.
TEST(Performers, ThatShareARootAreMeasuredEachAlone) {
  const auto joint = [](const std::string& name, double x, double y, const std::string& below) {
    return fmt::format("JOINT {}\n{{\nOFFSET {} {} 0\nCHANNELS 0\n{}}}\n", name, x, y,
                       below.empty() ? "End Site\n{\nOFFSET 0 0 0\n}\n" : below);
  };
  const auto body = [&](double size, const std::string& in_hand) {
    return joint("Head", 0, 80 * size, "") + joint("LeftHand", 60 * size, 40 * size, in_hand) +
           joint("RightHand", -60 * size, 40 * size, "") + joint("LeftFoot", 10 * size, -90 * size, "") +
           joint("RightFoot", -10 * size, -90 * size, "");
  };
  const auto clip_of = [](const std::string& joints, const std::string& head_joint) {
    BvhOptions options;
    options.head_joint = head_joint;
    options.recentre = false;
    return parse_bvh("HIERARCHY\nROOT Scene\n{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\n" +
                         joints + "}\nMOTION\nFrames: 2\nFrame Time: .01\n0 90 0\n5 90 0\n",
                     "x.bvh", options)
        .value();
  };
  const std::string two = joint("Hips", 300, 0, body(1.0, "")) + joint("Hips", -3000, 810, body(10.0, ""));
  const MotionClip first = clip_of(two, ""), second = clip_of(two, "Head#2");
  EXPECT_EQ(first.file_unit_m, 0.01) << "by its own bones";
  EXPECT_EQ(second.file_unit_m, 0.001);
  EXPECT_EQ(first.up, "+Y");
  EXPECT_THAT(first.head_reason, testing::HasSubstr("the one with Head is taken, others have Head#2"));
  EXPECT_THAT(second.head_reason, testing::HasSubstr("the one with Head#2 is taken, others have Head "));
  EXPECT_LT(glm::distance(first.world_from_head[1].position_m, glm::dvec3(3.05, 1.7, 0.0)), 1e-9);
  const MotionClip smith = clip_of(body(1.0, joint("hammer.head", 0, -30, "")), "");
  EXPECT_EQ(smith.file_unit_m, 0.01);
  EXPECT_THAT(smith.head_reason, testing::HasSubstr("the head is Head "));
}

TEST(MotionFileAxes, MayHaveYDown) {
  constexpr std::string_view kHead =
      "CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation\nJOINT Head\n{\n";
  const auto clip_of = [&](const std::string& offset, const std::string& row,
                           std::optional<bool> is_z_up = {}) {
    BvhOptions options;
    options.unit_m = 1.0;
    options.recentre = false;
    options.is_z_up = is_z_up;
    auto clip = parse_bvh(
        "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\n" + std::string(kHead) + "OFFSET " + offset +
            "\nCHANNELS 0\nEnd Site\n{\nOFFSET 0 0 0\n}\n}\n}\nMOTION\nFrames: 1\nFrame Time: .01\n" + row +
            "\n",
        "m.bvh", options);
    EXPECT_TRUE(clip) << clip.error().to_string();
    return clip ? *clip : MotionClip{};
  };
  const MotionClip up = clip_of(".05 .7 .1", "1 .9 2 20 30 10");
  const MotionClip down = clip_of("-.05 -.7 .1", "-1 -.9 2 20 -30 -10");
  EXPECT_EQ(up.up_reason, "");
  EXPECT_THAT(down.up_reason, HasSubstr("-Y is taken as up"));
  const Pose& first = up.world_from_head[0];
  const Pose& other = down.world_from_head[0];
  EXPECT_LT(glm::distance(first.position_m, other.position_m), 1e-12);
  EXPECT_LT(angle_between_rad(first.rotation, other.rotation), 1e-7);
  EXPECT_LT(clip_of("-.05 -.7 .1", "-1 -.9 2 20 -30 -10", false).world_from_head[0].position_m.y, -1.0)
      << "stated";
}

// Small files that failed once, each with its right answer beside it.
TEST(CaseFiles, MotionComesInAsItShould) {
  struct Case {
    const char* name;
    double unit_m;  // 0: of no matter
    size_t frames;
    const char* said;  // by a note
  };
  const std::filesystem::path folder = std::filesystem::path(STRANDCAST_SHARED_DATA) / "cases";
  REQUIRE_SHARED(folder);
  for (const Case& item : {Case{"comma_decimals.bvh", 0.0, 24, "numbers have a decimal comma"},
                           {"frame_time_zero.bvh", 0.0, 24, ""},
                           {"frames_more_than_rows.bvh", 0.0, 24, "30 frames are announced, 24 are there"},
                           {"joint_spaces.bvh", 0.0, 24, "the head is Bip01 Head"},
                           {"nan_row.bvh", 0.0, 24, "1 of 24 frames cannot be used"},
                           {"upper_body_cm.bvh", 0.01, 24, "one unit is taken as 0.01 m"},
                           {"upper_body_m.bvh", 1.0, 24, "one unit is taken as 1 m"},
                           {"zero_offsets_positions.bvh", 0.01, 24, "one unit is taken as 0.01 m"}}) {
    MotionFileOptions options;
    options.fps = 30.0;
    options.is_keeping_first_frames = true;
    const auto motion = load_motion_file(folder / item.name, options);
    ASSERT_TRUE(motion) << motion.error().to_string();
    EXPECT_EQ(motion->clip.world_from_head.size(), item.frames) << item.name;
    EXPECT_TRUE(item.unit_m == 0.0 || motion->clip.file_unit_m == item.unit_m) << item.name;
    EXPECT_THAT(motion->notes, testing::Contains(HasSubstr(item.said))) << item.name;
  }
}

/// Rounded times would add up: the last of 240 frames came after the end of its clip.
TEST(MotionFile, ARoundedFrameTimeIsThatOfItsRate) {
  for (const double rounded : {0.0333333, 0.033333}) EXPECT_EQ(exact_frame_s(rounded), 1.0 / 30.0) << rounded;
  EXPECT_EQ(exact_frame_s(0.04166667), 1.0 / 24.0);
  EXPECT_EQ(exact_frame_s(0.008333), 1.0 / 120.0);
  EXPECT_EQ(exact_frame_s(0.0333667), 1001.0 / 30'000.0);
  EXPECT_EQ(exact_frame_s(0.041708), 1001.0 / 24'000.0);
  for (const double other : {0.0333, 0.0416, 0.0217, 1.5})
    EXPECT_EQ(exact_frame_s(other), other) << "it may be meant";
}

TEST(MotionFile, AnotherKindOfFileIsNamed) {
  const TemporaryFolder folder;
  for (const auto& [begin, said] : {std::pair("\x1f\x8b\x08", "packed by gzip"),
                                    {"Kaydara FBX Binary", "it is FBX"},
                                    {"\xff\xfeH", "it is UTF-16"},
                                    {"", "it is empty"}})
    EXPECT_THAT(load_motion_file(folder.write("x.bvh", begin), {}).error().to_string(), HasSubstr(said));
}

// A person who states a wrong unit or axis reads about a head that is too fast, and filters what is right.
TEST(MotionFile, DoubtsAStatedUnitAndAxisThatMakeNoBody) {
  const std::filesystem::path clip = std::filesystem::path(STRANDCAST_SHARED_DATA) / "mocap/pirouette.bvh";
  const auto metres = load_motion_file(clip, {.unit_m = 1.0, .up = "", .joint = ""});
  ASSERT_TRUE(metres) << metres.error().to_string();
  EXPECT_THAT(metres->notes, testing::Contains(HasSubstr("as of no body: 0.01 m is likely (--unit)")));
  EXPECT_THAT(metres->notes, Not(testing::Contains(HasSubstr("--filter-glitches"))));
  const auto z_up = load_motion_file(clip, {.unit_m = 0.0, .up = "z", .joint = ""});
  ASSERT_TRUE(z_up) << z_up.error().to_string();
  EXPECT_THAT(z_up->notes, testing::Contains(HasSubstr("degrees off upright: +Y is likely (--up)")));
  MotionFileOptions of_bake;
  of_bake.prefix = "--motion-";
  EXPECT_THAT(load_motion_file(clip, of_bake)->notes,
              testing::Contains(HasSubstr("(--motion-unit states another)")));
  const auto right = load_motion_file(clip, {.unit_m = 0.01, .up = "y", .joint = ""});
  ASSERT_TRUE(right) << right.error().to_string();
  EXPECT_THAT(right->notes, Not(testing::Contains(HasSubstr("is likely"))));
}

}  // namespace
}  // namespace strandcast::motion_test
