// GLFW's side of a window: the screen, keys and the mouse.
#include "render/window.h"

#include <vulkan/vulkan.h>
// after it, so that GLFW declares what it has for Vulkan
#include <GLFW/glfw3.h>

#include "db/error.h"
#include "render/vulkan/collage_impl.h"

namespace patchwork {

namespace {

std::string& last_problem() {
  static std::string text;
  return text;
}

[[noreturn]] void refuse(const std::string& otherwise) {
  const std::string& said = last_problem();
  throw Error("window", said.empty() ? otherwise : said,
              "is there a display? `patchwork render` makes pictures without one");
}

// GLFW as long as there is a window.
struct Screen {
  Screen() {
    last_problem().clear();
    glfwSetErrorCallback([](int, const char* text) { last_problem() = text; });
    if (!glfwInit()) refuse("it cannot be opened");
  }
  ~Screen() { glfwTerminate(); }
};

struct CloseWindow {
  void operator()(GLFWwindow* w) const { glfwDestroyWindow(w); }
};
using OwnedWindow = std::unique_ptr<GLFWwindow, CloseWindow>;

// Commands are characters, wherever a keyboard has them; steering keys are places on it.
struct Typed {
  unsigned character;
  Command command;
};
constexpr Typed kTyped[] = {{'o', Command::overlay}, {'m', Command::map},   {'g', Command::wireframe},
                            {'p', Command::print},   {'+', Command::finer}, {'-', Command::coarser},
                            {' ', Command::play}};

unsigned lower(unsigned character) {
  return character >= 'A' && character <= 'Z' ? character + ('a' - 'A') : character;
}

OwnedWindow make_window(const WindowOptions& o) {
  glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
  OwnedWindow window(glfwCreateWindow(o.width, o.height, o.title.c_str(), nullptr, nullptr));
  if (!window) refuse("it cannot be opened");
  // A key that was down and up again between two looks counts as held at the second.
  glfwSetInputMode(window.get(), GLFW_STICKY_KEYS, GLFW_TRUE);
  return window;
}

std::shared_ptr<Device> open_device(bool validation) {
  std::uint32_t n = 0;
  const char** names = glfwGetRequiredInstanceExtensions(&n);
  if (!names) refuse("Vulkan cannot draw on this display");
  return Device::open({.validation = validation,
                       .instance_extensions = {names, names + n},
                       .device_extensions = {VK_KHR_SWAPCHAIN_EXTENSION_NAME}});
}

vk::OwnedSurface make_surface(const Device& device, GLFWwindow* window) {
  const VkInstance instance = device.impl().instance.get();
  VkSurfaceKHR surface = VK_NULL_HANDLE;
  if (glfwCreateWindowSurface(instance, window, nullptr, &surface) != VK_SUCCESS)
    refuse("Vulkan cannot draw on this display");
  return {instance, surface};
}

}  // namespace

struct Window::Impl {
  Screen screen;
  OwnedWindow window;
  std::shared_ptr<Device> device;
  vk::Swapchain chain;
  vk::Collage collage;
  VkExtent2D size{};
  WindowInput input;
  double mouse_x = 0, mouse_y = 0;

  explicit Impl(const WindowOptions& o)
      : window(make_window(o)),
        device(open_device(o.validation)),
        chain(device->impl(), make_surface(*device, window.get())),
        collage(device->impl()) {
    glfwSetWindowUserPointer(window.get(), this);
    listen();
    fit();
  }

  static Impl& of(GLFWwindow* w) { return *static_cast<Impl*>(glfwGetWindowUserPointer(w)); }
  bool held(int key) const { return glfwGetKey(window.get(), key) == GLFW_PRESS; }
  double balance(int plus, int minus) const { return double(held(plus)) - double(held(minus)); }

  void listen();
  void typed(unsigned character);
  void moved(double x, double y);
  void fit();
  Steering steering() const;
};

void Window::Impl::typed(unsigned character) {
  for (const Typed& t : kTyped)
    if (t.character == lower(character)) input.commands.push_back(t.command);
}

void Window::Impl::moved(double x, double y) {
  const auto down = [&](int b) { return glfwGetMouseButton(window.get(), b) == GLFW_PRESS; };
  if (down(GLFW_MOUSE_BUTTON_LEFT) || down(GLFW_MOUSE_BUTTON_RIGHT))
    input.drag_x += x - mouse_x, input.drag_y += y - mouse_y;
  mouse_x = x, mouse_y = y;
}

void Window::Impl::listen() {
  GLFWwindow* w = window.get();
  glfwSetCharCallback(w, [](GLFWwindow* of_, unsigned c) { of(of_).typed(c); });
  glfwSetKeyCallback(w, [](GLFWwindow* of_, int key, int, int action, int) {
    if (action != GLFW_PRESS) return;
    if (key == GLFW_KEY_ESCAPE) of(of_).input.commands.push_back(Command::end);
    if (key == GLFW_KEY_F1) of(of_).input.commands.push_back(Command::help);
  });
  glfwSetWindowCloseCallback(w, [](GLFWwindow* of_) { of(of_).input.commands.push_back(Command::end); });
  glfwSetWindowRefreshCallback(w, [](GLFWwindow* of_) { of(of_).input.damaged = true; });
  glfwSetCursorPosCallback(w, [](GLFWwindow* of_, double x, double y) { of(of_).moved(x, y); });
  glfwSetScrollCallback(w, [](GLFWwindow* of_, double, double notches) {
    const Impl& impl = of(of_);
    const bool ctrl = impl.held(GLFW_KEY_LEFT_CONTROL) || impl.held(GLFW_KEY_RIGHT_CONTROL);
    (ctrl ? of(of_).input.zoom : of(of_).input.speed) += notches;
  });
}

Steering Window::Impl::steering() const {
  return {.right = balance(GLFW_KEY_D, GLFW_KEY_A),
          .forward = balance(GLFW_KEY_W, GLFW_KEY_S),
          .up = balance(GLFW_KEY_E, GLFW_KEY_Q),
          .turn = balance(GLFW_KEY_LEFT, GLFW_KEY_RIGHT),
          .tilt = balance(GLFW_KEY_UP, GLFW_KEY_DOWN),
          .fast = held(GLFW_KEY_LEFT_SHIFT) || held(GLFW_KEY_RIGHT_SHIFT)};
}

void Window::Impl::fit() {
  int width = 0, height = 0;
  glfwGetFramebufferSize(window.get(), &width, &height);
  size = width > 0 && height > 0 ? chain.fit({std::uint32_t(width), std::uint32_t(height)}) : VkExtent2D{};
}

Window::Window(const WindowOptions& options) : impl_(std::make_unique<Impl>(options)) {}
Window::~Window() = default;

const std::shared_ptr<Device>& Window::device() const { return impl_->device; }
int Window::width() const { return int(impl_->size.width); }
int Window::height() const { return int(impl_->size.height); }

WindowInput Window::look(double seconds) {
  if (seconds > 0)
    glfwWaitEventsTimeout(seconds);
  else
    glfwPollEvents();
  impl_->fit();
  WindowInput input = std::move(impl_->input);
  impl_->input = {};
  input.steering = impl_->steering();
  return input;
}

void Window::show(const Renderer& renderer, std::span<const Panel> panels) {
  Impl& w = *impl_;
  const auto compose = [&](VkCommandBuffer commands, const vk::Destination& to) {
    w.collage.record(commands, renderer.target(), panels, to);
  };
  // A window that changes its size at every turn is shown again when it rests.
  for (int turn = 0; turn < 3 && w.size.width > 0; ++turn) {
    if (w.chain.show(compose)) return;
    w.fit();
  }
}

Image Window::shown(const Renderer& renderer, std::span<const Panel> panels) {
  Impl& w = *impl_;
  const vk::Target& target = renderer.target();
  const VkExtent2D size = target.size();
  const vk::Texture to(w.device->impl(),
                       {.width = size.width,
                        .height = size.height,
                        .usage = VK_IMAGE_USAGE_TRANSFER_DST_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT |
                                 VK_IMAGE_USAGE_SAMPLED_BIT});  // for its view, which nobody uses
  const vk::Buffer pixels(w.device->impl(), VkDeviceSize{4} * size.width * size.height, 0,
                          vk::Where::readback);
  vk::Commands commands(w.device->impl());
  const VkCommandBuffer c = commands.begin();
  to.change(c, VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
  w.collage.record(c, target, panels, {to.get(), size, false});
  to.change(c, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
  VkBufferImageCopy region{};
  region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
  region.imageExtent = {size.width, size.height, 1};
  vkCmdCopyImageToBuffer(c, to.get(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, pixels.get(), 1, &region);
  vk::barrier(c);
  commands.submit(), commands.wait();
  Image image(int(size.width), int(size.height), {});
  const auto* from = reinterpret_cast<const std::uint32_t*>(pixels.mapped());
  for (std::size_t k = 0; k < image.pixels.size(); ++k)
    image.pixels[k] = {std::uint8_t(from[k]), std::uint8_t(from[k] >> 8), std::uint8_t(from[k] >> 16)};
  return image;
}

}  // namespace patchwork
