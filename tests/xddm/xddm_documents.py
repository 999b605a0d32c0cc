"""Small documents that tests of XDDM share."""

MODEL = """<?xml version="1.0" encoding="ISO-8859-1"?>
<!-- a half wing: what the framework asks -->
<Model ID="wing" Modeler="moldline" Wrapper='run.sh' colour = "blue">
  <Variable ID="span"  value="6.0"  Min="5"  MAX="8" TypicalSize="1" FDstep="1e-4" Comment="oFD"/>
  <Variable ID='sweep' Value='25' Min='0' Max='40' note="a &lt; b &amp; &#34;c&#34;"/>
  <Constant ID="chord" Value="2.0"/>
  <Lattice ID="sections">    <!-- opens a namespace -->
    <Variable ID="dz[3,1]" Value="0.0" Min="-0.1" Max="0.1" TypicalSize="0.05"/>
    <Deeper ID="tip"><Variable ID="dz" Value="-888888"/></Deeper>
  </Lattice>
  <Analysis ID="Volume" Sensitivity="required"/>
  <Analysis ID="Thickness" Sensitivity="None"></Analysis>
  <Function ID="Ratio" Expr="Volume / chord^2"/>
  <Tessellate MaxEdge="0.02" Sag="0.001" Angle="12"/>
  <Tessellate ID="1" MaxEdge="0.01" Sag="0.0005" Angle="8" Grid="fine"/>
  <Foreign><Variable ID="unread" Value="1"/><![CDATA[<kept> & as it is]]></Foreign>
  <?tool keep this?>
</Model>
"""

DESIGN = """<?xml version="1.0" encoding="ISO-8859-1"?>
<Optimize>
  <Configure Sensitivity="Required"/>
  <Intersect ID="wb" Parts="wing.xml, body.xml,pylon.tri"/>
  <DesignPoint ID="A" Geometry="wb">
    <Constant ID="Mach" Value="0.70"/>
    <Variable ID="alpha" Value="3.0" Min="0" Max="6" TypicalSize="1"/>
    <Analysis ID="CL" Value="0.5">
      <AeroFun>
        # lift
        optForce CL 2 0 0 1 0. 1. 0 entire
      </AeroFun>
      <SensitivityArray>
        <!-- by incidence first -->
        <Sensitivity P="Optimize__DesignPoint__A__Variable__alpha" Value="0.1"/>
        <Sensitivity P="Model__wing__Variable__span" Value="0.01"/>
      </SensitivityArray>
    </Analysis>
    <Analysis ID="CD" Value="0.02">
      <SensitivityArray>
        <Sensitivity P="Optimize__DesignPoint__A__Variable__alpha" Value="0.002"/>
      </SensitivityArray>
    </Analysis>
    <Function ID="J" Expr="CD + 10*(1-CL/0.56)^2"/>
  </DesignPoint>
  <DesignPoint ID="B" Geometry="wb">
    <Variable ID="alpha" Value="2.0" Min="0" Max="6" TypicalSize="1"/>
    <Analysis ID="CL" Value="0.4"/>
    <Analysis ID="CD" Value="0.03"/>
    <Function ID="J" Expr="CD + 10*(1-CL/0.56)^2 + 0*alpha"/>
  </DesignPoint>
  <Objective ID="total" Expr="DesignPoint__A__Function__J + DesignPoint__B__Function__J"/>
  <Constraint ID="vol" Expr="Model__wing__Analysis__Volume" Min="0.85" Max="9" Bound="lower"/>
  <Sum ID="drag" Expr="DesignPoint__A__Analysis__CD * 2"/>
</Optimize>
"""

FUNCTIONALS = """<?xml version="1.0"?>
<Functionals>   <!-- of the flow -->
  <AeroFun ID="LplusD" Options="Adapt">
    # both forces
    optForce CL 2 0 0 1 0. 0.1 0 entire   # lift
    <!-- a comment
         of two lines -->
    optForce CD 0 0 0 1 0. 1.0 0 wing, body
  </AeroFun>
  <AeroFun ID="Pitch">optMoment_Point Cm 0 1 1 0 1 0. 1. 0 entire</AeroFun>
  <AeroFun ID="LoD">
    optLD LoD 0 0 1 1.0 0.001 0. 1. -1 entire
  </AeroFun>
</Functionals>
"""

CONFIGURATION = """<Configuration Name="wingbody" Source="Components.i.tri">
  <Component Name="wing"     Parent="lifting" Type="tri"><Data> Face Label=1,3 </Data></Component>
  <Component Name="fuselage"                  Type="tri"><Data> Face Label=2 </Data></Component>
  <Component Name="lifting"  Type="container"></Component>
</Configuration>
"""

ALL = {"model": MODEL, "design": DESIGN, "aero": FUNCTIONALS, "configuration": CONFIGURATION}
