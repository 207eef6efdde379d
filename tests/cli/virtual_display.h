// A display without a screen, what it shows, and a hand on its keys and mouse.
#pragma once

#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "render/picture.h"
#include "tests/cli/command.h"

namespace patchwork {

/// An X server of its own: Xvfb on the first free display. What it shows lies in a file (-fbdir), in the
/// format of xwd: a header of 32-bit big-endian numbers, a colour table, rows of BGRX.
class VirtualDisplay {
 public:
  /// `folder`: for its file. Fails the test where Xvfb does not start.
  VirtualDisplay(const std::string& folder, int width, int height) : file_(folder + "/Xvfb_screen0") {
    int ends[2] = {-1, -1};
    EXPECT_EQ(pipe(ends), 0);
    const std::string screen = std::to_string(width) + "x" + std::to_string(height) + "x24";
    server_ = fork();
    if (server_ == 0) {
      prctl(PR_SET_PDEATHSIG, SIGTERM);
      execlp("Xvfb", "Xvfb", "-displayfd", std::to_string(ends[1]).c_str(), "-screen", "0", screen.c_str(),
             "-fbdir", folder.c_str(), "-nolisten", "tcp", "-noreset", nullptr);
      _exit(127);
    }
    close(ends[1]);
    char c = 0;
    while (read(ends[0], &c, 1) == 1 && c != '\n') name_ += c;
    close(ends[0]);
    EXPECT_NE(name_, "") << "Xvfb does not start";
    name_ = ":" + name_;
  }
  ~VirtualDisplay() {
    kill(server_, SIGTERM);
    waitpid(server_, nullptr, 0);
  }
  VirtualDisplay(const VirtualDisplay&) = delete;
  VirtualDisplay& operator=(const VirtualDisplay&) = delete;

  const std::string& name() const { return name_; }

  /// Presses keys, moves the mouse: a command line of xdotool.
  void xdo(const std::string& words) const {
    EXPECT_EQ(std::system(("DISPLAY=" + name_ + " xdotool " + words + " > /dev/null").c_str()), 0) << words;
  }

  /// The upper left part of the screen.
  Image screen(int width, int height) const {
    const std::string bytes = text_of(file_);
    const auto number = [&](std::size_t k) {
      const auto* p = reinterpret_cast<const unsigned char*>(bytes.data()) + 4 * k;
      return std::size_t(p[0]) << 24 | std::size_t(p[1]) << 16 | std::size_t(p[2]) << 8 | p[3];
    };
    Image image(width, height, {});
    if (bytes.size() < 100) return image;
    const std::size_t data = number(0) + 12 * number(19), row = number(12);
    EXPECT_EQ(number(11), 32u) << "bits a pixel";
    EXPECT_GE(bytes.size(), data + row * std::size_t(height));
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const char* p = bytes.data() + data + row * std::size_t(y) + 4 * std::size_t(x);
        image.at(x, y) = {std::uint8_t(p[2]), std::uint8_t(p[1]), std::uint8_t(p[0])};
      }
    return image;
  }

  /// The same once something is there, it is not `unlike`, and it has not changed for 0.7 s; fails the test
  /// after 20 s.
  Image settled(int width, int height, const Image& unlike = {}) const {
    Image last(width, height, {});
    const Image black(width, height, {});
    int same = 0;
    for (int n = 0; n < 200; ++n) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      Image now = screen(width, height);
      const bool there = now.pixels != black.pixels && now.pixels != unlike.pixels;
      same = there && now.pixels == last.pixels ? same + 1 : 0;
      last = std::move(now);
      if (same >= 7) return last;
    }
    ADD_FAILURE() << "the screen does not come to rest";
    return last;
  }

 private:
  std::string file_, name_;
  pid_t server_ = -1;
};

}  // namespace patchwork
