// patchwork sample: what it takes for a point, what it answers, and where it gives up.
#include "tests/cli/command.h"

namespace patchwork {

namespace {

// Centre of pixel (10, 10) of the hill grid, and its height as the file holds it.
constexpr double kX = 500105, kY = 4999895;
double stored_height() { return std::round(256 * hills(kX, kY)) / 256; }

Words fields(const std::string& line) {
  std::istringstream in(line);
  Words words;
  for (std::string w; in >> w;) words.push_back(w);
  return words;
}

}  // namespace

class Sample : public CliTest {
 protected:
  Words sample(const std::string& input, const Words& options = {}) const {
    Words words{"sample", in_directory("hills.pwk")};
    words.insert(words.end(), options.begin(), options.end());
    const Outcome o = run(words, {.input = input});
    EXPECT_EQ(o.code, 0) << o.err;
    return lines_of(o.out);
  }
  const std::string database_ = hill_database();
};

TEST_F(Sample, AnswersWithPointHeightBoundAndGrid) {
  const Words lines = sample("500105 4999895\n");
  ASSERT_EQ(lines.size(), 1u);
  const Words f = fields(lines[0]);
  ASSERT_EQ(f.size(), 5u);
  EXPECT_EQ(std::stod(f[0]), kX);
  EXPECT_EQ(std::stod(f[1]), kY);
  EXPECT_EQ(std::stod(f[2]), stored_height()) << "a vertex answers with its own sample";
  EXPECT_GE(std::stod(f[3]), 0.1);
  EXPECT_LT(std::stod(f[3]), 0.2);
  EXPECT_EQ(f[4], "hills");
}

TEST_F(Sample, TakesEveryUsualFormOfAPoint) {
  const std::string want = sample("500105 4999895\n").at(0);
  for (const char* form : {"500105 4999895",
                           "500105,4999895\n",
                           "500105;4999895\n",
                           "500105\t4999895\r\n",
                           "  500105   4999895  77 name\n",
                           "+500105 4.999895e6\n",
                           "# a comment\n\n500105 4999895\n",
                           "x,y\n500105,4999895\n",
                           "x y\r\n500105 4999895\r\n",
                           "name,y,x\na,4999895,500105\n",
                           "\"x\",\"y\",\"z\"\n500105,4999895,3\n",
                           "east north\n500105 4999895\n",
                           ",x,y\n0,500105,4999895\n",
                           "id,name,x,y,z\n7,,500105,4999895,310\n",
                           "\tx\ty\n0\t500105\t4999895\n",
                           "name,x,y\n\"Lake, 2\",500105,4999895\n",
                           "id Northing Easting\n3 4999895 500105\n",
                           "name;x;y\nLake 2;500105;4999895\n",
                           "name,x,y\n\"Foo; Bar\",500105,4999895\n",
                           "name x y\n\"Lake, \"\"2\"\"; N\" 500105 4999895\n",
                           "pipe;x;y\n5\" wide;500105;4999895\n",
                           "\xEF\xBB\xBFx,y\n500105,4999895\n",
                           "name,z,x,y\n\"a \"\"b\"\", c\",310,500105,4999895\n",
                           "# a comment\nx,y\n500105,4999895\n"}) {
    const Words lines = sample(form);
    ASSERT_EQ(lines.size(), 1u) << form;
    EXPECT_EQ(lines[0], want) << form;
  }
  EXPECT_NE(sample("500106 4999895\n").at(0), want) << "another point answers otherwise";
}

TEST_F(Sample, NamesTheLineThatItCannotRead) {
  for (const auto& [input, line] :
       std::vector<std::pair<std::string, std::string>>{{"500105 4999895\n500105 abc\n", "line 2"},
                                                        {"500105\n", "line 1"},
                                                        {"x,y\n1,2\n\n# c\n3;\n", "line 5"},
                                                        {"1 2\nx y\n", "line 2"},
                                                        {"1 2\n1.5.5 2\n", "line 2"},
                                                        {"500105,,4999895\n", "line 1"},
                                                        {",500105,4999895\n", "line 1"},
                                                        {"500105 4999895,\n", "line 1"},
                                                        {"1 2\n,,\n", "line 2"},
                                                        {"500105,5;4999895,5\n", "line 1"},
                                                        {"id,x,y\n1,,4999895\n", "line 2"},
                                                        {"id,x,z\n1,500105,3\n", "no column y"},
                                                        {"id,x_utm,y_utm\n1,2,3\n", "no column x"}}) {
    const Outcome o = run({"sample", database_}, {.input = input});
    EXPECT_SAYS(complaint(o), line) << input;
    EXPECT_EQ(lines_of(complaint(o)).size(), 1u) << input;
  }
  EXPECT_EQ(run({"sample", database_}, {.input = "1 2\n1.5 2\n"}).code, 0);
}

TEST_F(Sample, SaysNanWhereNothingAnswers) {
  EXPECT_EQ(sample("1 2\nnan 4999895\n500105 inf\n"),
            (Words{"1 2 nan nan -", "nan 4999895 nan nan -", "500105 inf nan nan -"}));
  EXPECT_EQ(sample("500105 4999895\n", {"--error", "0.01", "--strict"}).at(0), "500105 4999895 nan nan -")
      << "the grid's accuracy is 0.1 m";
  EXPECT_NE(sample("500105 4999895\n", {"--error", "0.01"}).at(0), "500105 4999895 nan nan -")
      << "the best there is, unless strict";
}

TEST_F(Sample, StreamsAnyNumberInOrder) {
  constexpr int n = 300000;  // more than one batch
  std::string points;
  for (int k = 0; k < n; ++k)
    points += std::to_string(500000 + k % 600) + " " + std::to_string(4999500 + k % 499) + "\n";
  const Words lines = sample(points);
  ASSERT_EQ(lines.size(), size_t(n));
  for (const int k : {0, 1, 262143, 262144, n - 1}) {
    const Words f = fields(lines[size_t(k)]);
    EXPECT_EQ(std::stod(f[0]), 500000 + k % 600);
    EXPECT_EQ(std::stod(f[1]), 4999500 + k % 499);
  }
  EXPECT_EQ(sample("").size(), 0u);
}

TEST_F(Sample, KeepsItsBoundAtEveryErrorSmoothnessAndBlend) {
  std::string points;
  for (int k = 0; k < 500; ++k)
    points +=
        std::to_string(500010 + 1.13 * k) + " " + std::to_string(4999990 - 0.93 * ((k * 7) % 500)) + "\n";
  for (const char* error : {"0", "0.5", "50"})
    for (const char* smoothness : {"0", "1", "2"})
      for (const char* blend : {"priority", "weighted"}) {
        std::size_t wrong = 0;
        for (const std::string& line :
             sample(points, {"--error", error, "--smoothness", smoothness, "--blend", blend})) {
          const Words f = fields(line);
          // 0.1 m was promised on import; the bilinear surface of 10 m cells is 0.04 m from the hills at
          // most.
          wrong += !(std::abs(std::stod(f[2]) - hills(std::stod(f[0]), std::stod(f[1]))) <= std::stod(f[3]));
        }
        EXPECT_EQ(wrong, 0u) << error << " " << smoothness << " " << blend;
      }
}

TEST_F(Sample, OnTheGraphicsCardTheAnswersAreTheCpus) {
  std::string points;
  for (int k = 0; k < 500; ++k)
    points += std::to_string(500000 + 3.7 * k) + " " + std::to_string(5000000 - 2.9 * k) + "\n";
  points += "0 0\nnan 5\n";
  const Words cpu = sample(points), gpu = sample(points, {"--engine", "vulkan"});
  ASSERT_EQ(cpu.size(), gpu.size());
  for (std::size_t k = 0; k < cpu.size(); ++k) {
    const Words a = fields(cpu[k]), b = fields(gpu[k]);
    EXPECT_EQ(a[4], b[4]) << "the same grid answers";
    if (a[2] != "nan") {
      EXPECT_NEAR(std::stod(a[2]), std::stod(b[2]), 1e-6);
    }
  }
}

TEST_F(Sample, ADeviceThatIsNotThereIsNamed) {
  setenv("PATCHWORK_DEVICE", "no such card", 1);
  const Outcome o = run({"sample", database_, "--engine", "vulkan"}, {.input = "500105 4999895\n"});
  unsetenv("PATCHWORK_DEVICE");
  EXPECT_EQ(o.code, 1);
  EXPECT_NE(o.err.find("no such card"), std::string::npos) << o.err;
}

}  // namespace patchwork
