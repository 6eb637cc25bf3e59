"""OpenGL shaders of the renderer, and the programs compiled from them.

Amounts of light are linear until the very end, as in `rendering.shading`, whose formulas these are.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from OpenGL import GL

from cellwright.rendering.backend import NoOpenGL

SKY_MAPS = 8
"""Directions from which it is looked up how much of the sky a surface sees."""

_CORNER = """
#version 330 core
layout(location = 0) in vec3 point;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 colour;
layout(location = 3) in uint body;
layout(location = 4) in uint is_plane;
uniform samplerBuffer bodies;  // two texels each: place, and whether it is shown; quaternion x 3 after w
uniform mat4 clip_T_world;
out vec3 world_at;
out vec3 world_normal;
flat out vec4 surface;
flat out float tiled;

vec3 turned(vec4 wxyz, vec3 v) {
    return v + 2.0 * cross(wxyz.yzw, cross(wxyz.yzw, v) + wxyz.x * v);
}

void main() {
    vec4 place = texelFetch(bodies, 2 * int(body));
    vec4 turn = texelFetch(bodies, 2 * int(body) + 1);
    world_at = turned(turn, point) + place.xyz;
    world_normal = turned(turn, normal);
    surface = colour;
    tiled = float(is_plane);
    gl_Position = clip_T_world * vec4(world_at, 1.0);
    if (place.w == 0.0) gl_Position = vec4(0.0, 0.0, -2.0, 1.0);  // every corner: nothing is drawn
}
"""

CORNER = _CORNER.lstrip()

NOTHING = "#version 330 core\nvoid main() {}\n"
"""For maps of depth, which are written all the same."""

DEPTH = """
#version 330 core
uniform vec3 eye;
uniform vec3 forward;
in vec3 world_at;
out float depth;
void main() { depth = dot(world_at - eye, forward); }
""".lstrip()

_BACKGROUND = """
vec3 background(vec3 ray) {
    return mix(HORIZON, ZENITH, smoothstep(0.0, 0.7, ray.z));
}

vec3 on_screen(vec3 light) {
    vec3 over = max(light - KNEE, 0.0);
    float room = 1.0 - KNEE;
    vec3 shown = min(light, KNEE) + room * over / (over + room);
    return mix(1.055 * pow(max(shown, 0.0031308), vec3(1.0 / 2.4)) - 0.055, 12.92 * shown,
               vec3(lessThanEqual(shown, vec3(0.0031308))));
}
"""

BEHIND_CORNER = """
#version 330 core
uniform mat4 world_T_clip;
out vec3 direction;
void main() {
    vec2 at = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    direction = (world_T_clip * vec4(at, 1.0, 1.0)).xyz;
    gl_Position = vec4(at, 1.0, 1.0);
}
""".lstrip()

SMOOTHING = """
#version 330 core
uniform sampler2D drawn;
out vec4 pixel;

const vec3 BRIGHTNESS = vec3(0.299, 0.587, 0.114);
const float LONGEST = 8.0;  // pixels along an edge that are looked at

vec3 colour(vec2 at) { return textureLod(drawn, at, 0.0).rgb; }

void main() {
    vec2 size = 1.0 / vec2(textureSize(drawn, 0));
    vec2 here = gl_FragCoord.xy * size;
    vec3 middle = colour(here);
    float centre = dot(middle, BRIGHTNESS);
    // corners of a square about the pixel, clockwise from the upper left
    vec4 corners = vec4(dot(colour(here + vec2(-0.5, -0.5) * size), BRIGHTNESS),
                        dot(colour(here + vec2(0.5, -0.5) * size), BRIGHTNESS),
                        dot(colour(here + vec2(0.5, 0.5) * size), BRIGHTNESS),
                        dot(colour(here + vec2(-0.5, 0.5) * size), BRIGHTNESS));
    float low = min(centre, min(min(corners.x, corners.y), min(corners.z, corners.w)));
    float high = max(centre, max(max(corners.x, corners.y), max(corners.z, corners.w)));
    pixel = vec4(middle, 1.0);
    if (high - low < max(0.04, 0.1 * high)) return;  // no edge
    // an edge runs square to the way in which it gets brighter
    vec2 along = vec2(corners.z + corners.w - corners.x - corners.y, corners.x + corners.w - corners.y - corners.z);
    float least = min(abs(along.x), abs(along.y)) + 0.02;
    along = clamp(along / least, -LONGEST, LONGEST) * size;
    vec3 near = 0.5 * (colour(here - along / 6.0) + colour(here + along / 6.0));
    vec3 far = 0.5 * near + 0.25 * (colour(here - along / 2.0) + colour(here + along / 2.0));
    float found = dot(far, BRIGHTNESS);
    pixel.rgb = found < low || found > high ? near : far;  // too far along: something else is met
}
""".lstrip()

_HEAD = "#version 330 core\n"

_BEHIND = """
in vec3 direction;
out vec4 pixel;
void main() { pixel = vec4(on_screen(background(normalize(direction))), 1.0); }
"""

_SURFACE = """
uniform vec3 eye;
uniform vec3 lamp;
uniform bool has_shadows;
uniform mat4 lamp_T_world;
uniform mat4 sky_T_world[SKY_MAPS];
uniform vec3 sky_direction[SKY_MAPS];
uniform float lamp_offset;  // [m], how far off its surface a point is looked up
uniform float sky_offset;
uniform sampler2DShadow lamp_map;
uniform sampler2DArrayShadow sky_maps;
in vec3 world_at;
in vec3 world_normal;
flat in vec4 surface;
flat in float tiled;
out vec4 pixel;

float lit(vec3 normal) {
    vec4 at = lamp_T_world * vec4(world_at + normal * lamp_offset, 1.0);
    vec3 place = at.xyz / at.w * 0.5 + 0.5;
    if (at.w <= 0.0 || any(lessThan(place, vec3(0.0))) || any(greaterThan(place, vec3(1.0)))) return 1.0;
    vec2 texel = 1.0 / vec2(textureSize(lamp_map, 0));
    float sum = 0.0;
    for (int row = -1; row <= 1; row++)
        for (int column = -1; column <= 1; column++)
            sum += texture(lamp_map, vec3(place.xy + vec2(column, row) * texel * 1.4, place.z));
    return sum / 9.0;
}

float openness(vec3 normal) {
    float facing = 0.0, seen = 0.0;
    vec4 point = vec4(world_at + normal * sky_offset, 1.0);
    for (int number = 0; number < SKY_MAPS; number++) {
        float cosine = dot(normal, sky_direction[number]);
        if (cosine <= 0.0) continue;
        vec3 at = (sky_T_world[number] * point).xyz * 0.5 + 0.5;
        bool is_beside = any(lessThan(at, vec3(0.0))) || any(greaterThan(at, vec3(1.0)));
        facing += cosine;
        seen += cosine * (is_beside ? 1.0 : texture(sky_maps, vec4(at.xy, float(number), at.z)));
    }
    return facing > 0.0 ? seen / facing : 0.0;
}

float lines(vec2 at) {
    vec2 wide = max(fwidth(at), 1e-6);
    vec2 offset = abs(at - round(at / TILE) * TILE);
    vec2 covered = clamp((LINE + wide) / 2.0 - offset, vec2(0.0), min(vec2(LINE), wide)) / wide;
    float share = 1.0 - (1.0 - covered.x) * (1.0 - covered.y);
    return 1.0 - (1.0 - LINE_SHADE) * share;
}

void main() {
    vec3 away = world_at - eye;
    float distance = length(away);
    vec3 ray = away / distance;
    vec3 normal = normalize(world_normal);
    if (dot(normal, ray) > 0.0) normal = -normal;
    vec3 albedo = surface.rgb * (tiled > 0.0 ? lines(world_at.xy) : 1.0);

    vec3 to_lamp = normalize(lamp - world_at);
    float direct = max(0.0, dot(to_lamp, normal));
    float key = direct > 0.0 && has_shadows ? lit(normal) : 1.0;
    float open = has_shadows ? openness(normal) : 1.0;
    float up = 0.5 + 0.5 * normal.z;
    vec3 around = (SKY * up + GROUND * (1.0 - up)) * (BURIED + (1.0 - BURIED) * open);
    vec3 light = albedo * (direct * key * KEY + around);
    float highlight = pow(max(0.0, dot(normalize(to_lamp - ray), normal)), SHARPNESS);
    if (direct > 0.0) light += highlight * HIGHLIGHT * key * KEY;

    float haze = smoothstep(HAZE_START, HAZE_END, distance);
    pixel = vec4(on_screen(mix(light, background(ray), haze)), surface.a);
}
"""


def with_figures(figures: dict[str, str]) -> tuple[str, str]:
    """The pixels of surfaces, and those behind all of them, with figures by name in the shaders' language."""
    defined = "".join(f"#define {name} {value}\n" for name, value in figures.items())
    return _HEAD + defined + _BACKGROUND + _SURFACE, _HEAD + defined + _BACKGROUND + _BEHIND


class Program:
    """Two shaders that work together.

    Args:
        corner: the source of the one for corners.
        pixel: that of the one for pixels.

    Raises:
        NoOpenGL: this OpenGL does not take them.
    """

    def __init__(self, corner: str, pixel: str) -> None:
        self._number = GL.glCreateProgram()
        for kind, source in ((GL.GL_VERTEX_SHADER, corner), (GL.GL_FRAGMENT_SHADER, pixel)):
            shader = GL.glCreateShader(kind)
            GL.glShaderSource(shader, source)
            GL.glCompileShader(shader)
            if not GL.glGetShaderiv(shader, GL.GL_COMPILE_STATUS):
                raise NoOpenGL(f"a shader does not compile: {_text(GL.glGetShaderInfoLog(shader))}")
            GL.glAttachShader(self._number, shader)
        GL.glLinkProgram(self._number)
        if not GL.glGetProgramiv(self._number, GL.GL_LINK_STATUS):
            raise NoOpenGL(f"shaders do not fit together: {_text(GL.glGetProgramInfoLog(self._number))}")
        self._places: dict[str, int] = {}

    def use(self, **figures: Any) -> None:
        """Draw with it from now on, with these figures: whole numbers, floats, vectors, and matrices."""
        GL.glUseProgram(self._number)
        for name, value in figures.items():
            place = self._places.get(name)
            if place is None:
                place = self._places[name] = int(GL.glGetUniformLocation(self._number, name))
            if place >= 0:
                _set(place, value)


def _set(place: int, value: Any) -> None:
    if isinstance(value, int):
        GL.glUniform1i(place, value)
    elif isinstance(value, float):
        GL.glUniform1f(place, value)
    else:
        array = np.ascontiguousarray(value, np.float32)
        if array.shape[-2:] == (4, 4):
            GL.glUniformMatrix4fv(place, array.size // 16, True, array)
        else:
            GL.glUniform3fv(place, array.size // 3, array)


def _text(said: Any) -> str:
    return " ".join((said.decode(errors="replace") if isinstance(said, bytes) else str(said)).split())[:400]
