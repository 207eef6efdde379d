// patchwork view on a virtual display: real keys, and what the screen then shows. Vulkan's validation layer
// watches in all of them; one message makes the exit code 1.
#include <glm/geometric.hpp>

#include "render/scene.h"
#include "tests/cli/virtual_display.h"

namespace patchwork {

namespace {

constexpr int kWidth = 480, kHeight = 320;
constexpr int kPanel = 240;  // pixels on the left that figures may cover

// From the south over the hills' 600 m x 500 m.
const char* const kScene = R"({"camera": {"eye": [500300, 4999300, 520], "look": [500300, 4999750, 300]},
                               "pixel_error": 2, "background": "#102040"})";

int difference(const Color& a, const Color& b) {
  return std::max({std::abs(a.r - b.r), std::abs(a.g - b.g), std::abs(a.b - b.b)});
}

// Of the pixels right of the figures: the share that differs by more than `by`.
double changed(const Image& a, const Image& b, int by) {
  std::size_t n = 0, all = 0;
  for (int y = 0; y < a.height; ++y)
    for (int x = kPanel; x < a.width; ++x) ++all, n += difference(a.at(x, y), b.at(x, y)) > by;
  return double(n) / double(all);
}

Image read_picture(const std::string& path) {
  GDALDatasetUniquePtr file(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER));
  if (!file || file->GetRasterCount() != 3) return {};
  Image image(file->GetRasterXSize(), file->GetRasterYSize(), {});
  const CPLErr error =
      file->RasterIO(GF_Read, 0, 0, image.width, image.height, image.pixels.data(), image.width, image.height,
                     GDT_Byte, 3, nullptr, 3, 3 * image.width, 1, nullptr);
  return error == CE_None ? image : Image{};
}

}  // namespace

class View : public CliTest {
 protected:
  /// Runs `patchwork view` with `words` more on `display` while `person` acts; presses Esc in the end.
  Outcome fly(const VirtualDisplay& display, const std::string& database, Words words,
              const std::function<void()>& person, const char* scene_text = kScene) const {
    const std::string scene = in_directory("scene.json");
    write_text(scene, scene_text);
    words.insert(words.begin(), {"view", database, "--scene", scene, "--size", std::to_string(kWidth),
                                 std::to_string(kHeight), "--validation"});
    Circumstances c;
    c.in_child = [&] { setenv("DISPLAY", display.name().c_str(), 1); };
    c.meanwhile = [&](pid_t child) {
      person();
      display.xdo("key Escape");
      end_soon(child);
    };
    return run(words, c);
  }

 private:
  // A window that does not mind Esc must not hang the test.
  static void end_soon(pid_t child) {
    for (int n = 0; n < 100; ++n) {
      siginfo_t info{};
      waitid(P_PID, id_t(child), &info, WEXITED | WNOHANG | WNOWAIT);
      if (info.si_pid == child) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    kill(child, SIGKILL);
  }
};

TEST_F(View, FliesByKeysAndShowsWhatRenderMakes) {
  const VirtualDisplay display(in_directory(""), 640, 480);
  const std::string database = hill_database(), shot = in_directory("shot.png");
  Image before, after;
  const Outcome o = fly(display, database, {"--screenshot", shot}, [&] {
    before = display.settled(kWidth, kHeight);
    display.xdo("keydown w sleep 0.6 keyup w");
    after = display.settled(kWidth, kHeight, before);
    display.xdo("key p");
    display.settled(kWidth, kHeight);
  });
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(o.err, "");
  EXPECT_GT(changed(before, after, 8), 0.05) << "the picture moved";
  EXPECT_EQ(changed(after, read_picture(shot), 0), 0) << "the screenshot is what the screen showed";

  const Scene from = parse_scene(kScene, "the scene"), to = parse_scene(o.out, "what P printed");
  ASSERT_TRUE(to.camera);
  const glm::dvec3 ahead = glm::normalize(vec(from.camera->look) - vec(from.camera->eye));
  const glm::dvec3 way = vec(to.camera->eye) - vec(from.camera->eye);
  EXPECT_GT(glm::length(way), 10) << "metres";
  EXPECT_NEAR(glm::dot(way, ahead), glm::length(way), 1e-6) << "straight on";
  EXPECT_EQ(to.background, from.background) << "what was not flown stays as the scene had it";

  const std::string printed = in_directory("printed.json"), picture = in_directory("picture.png");
  write_text(printed, o.out);
  EXPECT_EQ(run({"render", database, picture, "--scene", printed}).code, 0);
  EXPECT_LT(changed(after, read_picture(picture), 2), 0.001);
  EXPECT_GT(changed(before, read_picture(picture), 2), 0.05) << "the control: another camera";
}

TEST_F(View, PlaysTheScenesPathUntilSomeoneSteers) {
  const VirtualDisplay display(in_directory(""), 640, 480);
  const std::string database = hill_database();
  const char* const scene =
      R"({"path": {"points": [[500100, 4999500, 420], [500300, 4999600, 420], [500500, 4999500, 420]],
                                "speed_m_s": 100}, "pixel_error": 4})";
  const Point3 first{500100, 4999500, 420}, last{500500, 4999500, 420};
  const auto printed = [](const std::string& out) { return *parse_scene(out, "what P printed").camera; };
  const Outcome played = fly(
      display, database, {},
      [&] {
        display.settled(kWidth, kHeight);  // at rest at the end of the way
        display.xdo("key p");
        display.settled(kWidth, kHeight);
      },
      scene);
  EXPECT_EQ(played.code, 0) << played.err;
  EXPECT_LT(glm::distance(vec(printed(played.out).eye), vec(last)), 1e-6);

  const Outcome steered = fly(
      display, database, {},
      [&] {
        display.settled(kWidth, kHeight);
        display.xdo("key space sleep 0.5 key e");  // once more, and up in the middle of the way
        display.settled(kWidth, kHeight);
        display.xdo("key p");
        display.settled(kWidth, kHeight);
      },
      scene);
  EXPECT_EQ(steered.code, 0) << steered.err;
  const Point3 eye = printed(steered.out).eye;
  EXPECT_GT(glm::distance(vec(eye), vec(last)), 1) << "it stayed where it was taken over";
  EXPECT_GT(glm::distance(vec(eye), vec(first)), 1);
  EXPECT_GT(eye.z, 420);
}

TEST_F(View, TurnsByTheMouseAndFollowsTheWindowsSize) {
  const VirtualDisplay display(in_directory(""), 800, 600);
  const std::string shot = in_directory("shot.png");
  const std::string database = hill_database();
  Image figures, small, mesh, again;
  const Outcome o = fly(display, database, {"--screenshot", shot}, [&] {
    display.settled(kWidth, kHeight);
    display.xdo("mousemove 240 160 mousedown 1 sleep 0.2 mousemove 340 160 sleep 0.2 mouseup 1");
    display.xdo("search --name Patchwork windowsize 700 400");
    figures = display.settled(700, 400);
    display.xdo("key o key plus key p");  // without figures, half an octave finer
    small = display.settled(700, 400, figures);
    display.xdo("key g");
    mesh = display.settled(700, 400, small);
    display.xdo("key g");
    again = display.settled(700, 400, mesh);
  });
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(o.err, "");
  EXPECT_EQ(read_picture(shot).pixels, small.pixels);
  EXPECT_GT(changed(small, mesh, 2), 0.01) << "edges of triangles";
  EXPECT_EQ(again.pixels, small.pixels);
  EXPECT_NE(figures.at(20, 20), small.at(20, 20)) << "figures lie over the corner";
  const Scene to = parse_scene(o.out, "what P printed");
  EXPECT_EQ(to.width, 700);
  EXPECT_EQ(to.height, 400);
  EXPECT_NEAR(to.pixel_error, std::sqrt(2), 1e-9);
  const glm::dvec3 ahead = vec(to.camera->look) - vec(to.camera->eye);
  EXPECT_LT(ahead.x, -50) << "metres: the ground went right with the mouse, so the eye turned left";
  EXPECT_GT(ahead.y, 100);

  const std::string printed = in_directory("printed.json"), picture = in_directory("picture.png");
  write_text(printed, o.out);
  EXPECT_EQ(run({"render", database, picture, "--scene", printed}).code, 0);
  EXPECT_LT(changed(small, read_picture(picture), 2), 0.001);
}

// Raised by 40 m on 200 m x 200 m in the middle; the window is told nothing of it.
TEST_F(View, ASurveyThatAnotherProcessImportsShowsUp) {
  const VirtualDisplay display(in_directory(""), 640, 480);
  const std::string database = hill_database();
  RasterFile survey = hill_file(20, 20, 250, -150);
  survey.at = [ground = survey.at](int i, int j) { return ground(i, j) + 40; };
  const std::string file = make(survey, "survey.tif");
  Image before, after, gone;
  const Outcome o = fly(display, database, {}, [&] {
    before = display.settled(kWidth, kHeight);
    Database writer = Database::open_existing(database);
    writer.import(RasterSource::open(file, {.accuracy = 0.05}, writer.crs()), {.name = "survey"});
    after = display.settled(kWidth, kHeight, before);
    writer.remove("survey");
    gone = display.settled(kWidth, kHeight, after);
  });
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(o.err, "");
  // Where the survey stands in the picture: its corners, low and high.
  Camera camera = parse_scene(kScene, "the scene").view();
  camera.width = kWidth, camera.height = kHeight;
  double left = kWidth, right = 0, top = kHeight, bottom = 0;
  for (const double x : {500250, 500450})
    for (const double y : {4999850, 4999650})
      for (const double z : {260, 385}) {
        const Seen s = see(camera, {x, y, z});
        left = std::min(left, s.x), right = std::max(right, s.x);
        top = std::min(top, s.y), bottom = std::max(bottom, s.y);
      }
  int inside = 0, outside = 0, area = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = kPanel; x < kWidth; ++x) {
      const bool in = x >= left && x <= right && y >= top && y <= bottom;
      const bool other = difference(before.at(x, y), after.at(x, y)) > 8;
      area += in, inside += in && other, outside += !in && other;
    }
  EXPECT_GT(inside, area / 4) << "of " << area;
  EXPECT_EQ(outside, 0);
  EXPECT_EQ(changed(before, gone, 0), 0) << "when it is gone, all is as it was";
}

TEST_F(View, EndsByItselfAfterSoManyFrames) {
  const VirtualDisplay display(in_directory(""), 640, 480);
  const std::string shot = in_directory("shot.png");
  Circumstances c;
  c.in_child = [&] { setenv("DISPLAY", display.name().c_str(), 1); };
  const Outcome o = run({"view", hill_database(), "--size", "320", "200", "--frames", "3", "--screenshot",
                         shot, "--validation"},
                        c);
  EXPECT_EQ(o.code, 0) << o.err;
  EXPECT_EQ(o.out + o.err, "");
  EXPECT_EQ(read_picture(shot).width, 320);
  EXPECT_EQ(read_picture(shot).height, 200);
}

TEST_F(View, SaysWhatIsWrong) {
  const std::string database = hill_database();
  Circumstances c;
  c.in_child = [] { unsetenv("DISPLAY"), unsetenv("WAYLAND_DISPLAY"); };
  const Outcome none = run({"view", database}, c);
  EXPECT_SAYS(complaint(none), "window: ");
  EXPECT_SAYS(complaint(none), "DISPLAY");
  EXPECT_SAYS(complaint(none), "patchwork render");
  EXPECT_SAYS(complaint(run({"view", in_directory("none.pwk")})), "none.pwk");
  EXPECT_SAYS(complaint(run({"view", database, "--scene", in_directory("none.json")})), "none.json");
  EXPECT_EQ(run({"view", database, "--frames", "0"}).code, 2);
  EXPECT_EQ(run({"view", database, "--size", "0", "10"}).code, 2);
}

}  // namespace patchwork
