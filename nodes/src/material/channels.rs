//! Table of the ports of all nodes that take the channels of a material one by one.

/// Declares a node with a port for each channel, after its other ports.
macro_rules! with_channels {
    (
        $(#[$meta:meta])*
        pub struct $name:ident {
            $($(#[$own_meta:meta])* $own:ident: $own_type:ty,)*
        }
    ) => {
        $crate::material::channels::with_channels! {
            @table [$(#[$meta])*] $name [$($(#[$own_meta])* $own: $own_type,)*]
            /// Diffuse or metal colour, scene-linear.
            #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
            base_color: AnyColor = BaseColor,
            /// Roughness, 0 (mirror) to 1.
            #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
            roughness: Number = Roughness,
            /// 0 for dielectrics, 1 for metals.
            #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
            metallic: Number = Metallic,
            /// Tangent-space normal. In space: relative to the cut, as `FiberShading` gives it; cuts lay it over the normal
            /// of the height.
            normal: AnyNormal = Normal,
            /// Height in mm.
            #[schemars(extend("unit" = "mm"))]
            height: Number = Height,
            /// Ambient occlusion: 1 is open, 0 is fully occluded.
            #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
            ao: Number = Ao,
            /// Opacity, 0..1.
            #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
            opacity: Number = Opacity,
            /// Sheen, 0..1.
            #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
            sheen: Number = Sheen,
            /// Clear coat, 0..1.
            #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
            coat: Number = Coat,
            /// Anisotropy, 0..1.
            #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
            anisotropy: Number = Anisotropy,
            /// Direction of brush lines or fibres in degrees, from +x towards +y on the canvas, where y points down: 0
            /// is along x, 90 along y. Highlights are narrow along it and wide across it. Adding 180° changes nothing.
            /// Exports convert the angle for each program.
            #[schemars(extend("minimum" = -360.0, "maximum" = 360.0, "unit" = "°"))]
            anisotropy_angle: Number = AnisotropyAngle,
            /// Roughness of the clear coat, 0..1.
            #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
            coat_roughness: Number = CoatRoughness,
            /// Normal of the clear coat; if not given, the coat is flat.
            coat_normal: AnyNormal = CoatNormal,
            /// Light that the surface emits, scene-linear.
            #[schemars(extend("minimum" = 0.0))]
            emission: AnyColor = Emission,
            /// Index of refraction.
            #[schemars(extend("minimum" = 1.0, "maximum" = 5.0))]
            ior: Number = Ior,
            /// Strength of the reflections of a dielectric, 0..1.
            #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
            specular: Number = Specular,
            /// Share of light that is scattered below the surface, 0..1.
            #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
            subsurface: Number = Subsurface,
        }
    };
    (
        @table [$(#[$meta:meta])*] $name:ident [$($(#[$own_meta:meta])* $own:ident: $own_type:ty,)*]
        $($(#[$doc:meta])* $field:ident: $type:ident = $channel:ident,)*
    ) => {
        $(#[$meta])*
        #[shibo_node::node]
        pub struct $name {
            $($(#[$own_meta])* pub $own: $own_type,)*
            $($(#[$doc])* pub $field: Option<shibo_node::In<shibo_node::$type>>,)*
        }

        impl $name {
            /// The channels that are connected.
            fn connected(&self) -> shibo_value::ChannelSet {
                let all = [$((shibo_value::Channel::$channel, self.$field.is_some()),)*];
                all.into_iter().filter_map(|(channel, connected)| connected.then_some(channel)).collect()
            }

            /// The ports whose values are all on the canvas or all in space.
            const PORTS: &'static [&'static str] = &[$(stringify!($own),)* $(stringify!($field),)*];

            /// The values of the connected channels.
            fn given(
                &self,
                cx: &shibo_node::Context<'_>,
            ) -> Result<Vec<(shibo_value::Channel, shibo_node::Anywhere)>, shibo_value::Stop> {
                let all = [$((shibo_value::Channel::$channel, cx.get_opt(&self.$field)?),)*];
                Ok(all.into_iter().filter_map(|(channel, value)| Some((channel, value?))).collect())
            }
        }
    };
}

pub(super) use with_channels;
