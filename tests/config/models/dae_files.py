"""DAE files made by hand: a unit square in the xy plane, with a red and a blue material."""

SQUARE = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]
RED = (1.0, 0.0, 0.0, 1.0)
FACE = '<input semantic="VERTEX" source="#v" offset="{}"/>'
"""Input of a primitive, with the offset of its vertices."""
_POSITIONS = " ".join(str(number) for corner in SQUARE for number in corner)
_DIFFUSE = "<profile_COMMON><technique><phong><diffuse><color>{}</color></diffuse></phong></technique></profile_COMMON>"
_MATERIALS = "".join(
    f'<library_effects><effect id="{name}-e">{_DIFFUSE.format(colour)}</effect></library_effects><library_materials>'
    f'<material id="{name}-m"><instance_effect url="#{name}-e"/></material></library_materials>'
    for name, colour in (("r", "1 0 0 0.5"), ("b", "0 0 7 1"))
)


def geometry(primitives: str = f"<triangles material='r-m'>{FACE.format(0)}<p>0 1 2 0 2 3</p></triangles>") -> str:
    """Return a library with the geometry `g`: the square as these primitives."""
    return (
        '<library_geometries><geometry id="g"><mesh>'
        f'<source id="s"><float_array count="12">{_POSITIONS}</float_array>'
        '<technique_common><accessor stride="3"/></technique_common></source>'
        f'<vertices id="v"><input semantic="POSITION" source="#s"/></vertices>{primitives}'
        "</mesh></geometry></library_geometries>"
    )


def collada(libraries: str, *, node: str = "<instance_geometry url='#g'/>", asset: str = "") -> str:
    """Return a DAE file whose scene has one node, `top`, with this content."""
    return (
        '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">'
        f"{asset}{_MATERIALS}{libraries}"
        f'<library_visual_scenes><visual_scene id="w"><node id="top">{node}</node></visual_scene>'
        "</library_visual_scenes>"
        '<scene><instance_visual_scene url="#w"/></scene></COLLADA>'
    )


def two_colours() -> str:
    """Return a DAE file with a red square at z = 0 and a blue one at z = 1, so that its hull is a unit cube."""
    bound = "<bind_material><technique_common><instance_material symbol='r-m' target='#b-m'/></technique_common>"
    upper = f"<instance_geometry url='#g'>{bound}</bind_material></instance_geometry>"
    return collada(geometry(), node=f"<instance_geometry url='#g'/><node><translate>0 0 1</translate>{upper}</node>")
